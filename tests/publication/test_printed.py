"""What pages show of a command's output is what the command prints for the roof of the notebooks."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import pytest
from programs import needs_ccx

import pcmc
from pcmc.cli import main
from pcmc.project import designed

HOME = Path(__file__).resolve().parents[2]
ROUNDING = 1e-9  # smaller numbers are rounding, and other on each machine
CHOSEN = (
    0.1  # of a number: remeshing and the merging of families choose by rounding, so they are others there
)
NUMBER = re.compile(r"-?\d[\d.]*(?:e[-+]\d+)?")


def shown(page, number=0):
    """A block of output on a page, as words."""
    text = (HOME / "docs" / page).read_text(encoding="utf-8")
    return re.findall(r"```text\n(.*?)```", text, re.S)[number].split()


def is_printed(words, output, close=0.0):
    """Whether these words stand in a row in the output, up to rounding and to the end "..." of the words;
    numbers up to ``close``, relative to them."""
    words = words[: words.index("...")] if "..." in words else words
    printed = output.split()
    starts = (k for k in range(len(printed)) if same(words[0], printed[k], close))
    alike = partial(same, close=close)
    return any(all(map(alike, words, printed[k:])) and len(printed) - k >= len(words) for k in starts)


def same(word, other, close=0.0):
    if word == other:
        return True
    numbers = [NUMBER.fullmatch(each.strip("(,;")) for each in (word, other)]
    if not all(numbers):
        return False
    one, two = (float(number[0]) for number in numbers)
    return abs(one - two) <= max(ROUNDING, close * abs(one))


@pytest.fixture
def roof(tmp_path, monkeypatch):
    """The roof of the notebooks as ``roof.toml``; called with an edge length, coarser."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    text = (HOME / "notebooks" / "roof.toml").read_text(encoding="utf-8").partition("[output]")[0]

    def with_edges(length):
        Path("roof.toml").write_text(re.sub(r"(?<=edge_length = ).*", str(length), text), encoding="utf-8")
        return "roof.toml"

    return with_edges


def test_words_in_a_row_up_to_rounding():
    assert is_printed(["b", "2.7e-13", "..."], "a b 3.1e-15 c")
    assert not is_printed(["b", "2.7"], "a b 2.8 c")
    assert not is_printed(["b", "c"], "a b")
    assert is_printed(["b", "(2.7"], "a b (2.8 c", close=0.1)
    assert not is_printed(["b", "2.7"], "a b 3.1 c", close=0.1)


@pytest.mark.nightly
def test_the_mesh_check_of_the_roof(roof, capsys):
    assert main(["solve", roof(0.7)]) == 0
    assert is_printed(shown("how-to/mesh-check.md"), capsys.readouterr().out)


@pytest.mark.nightly
def test_the_accuracy_of_the_roof_on_the_mesh_and_in_the_limit(roof, capsys):
    path = roof(1.2)
    page = (HOME / "docs" / "how-to" / "accuracy.md").read_text(encoding="utf-8")
    assert f"from {pcmc.project.build(path).m} triangles with `edge_length = 1.2`" in page
    assert main(["solve", path, "--accuracy", "height=1e-2"]) == 0
    assert is_printed(shown("how-to/accuracy.md"), capsys.readouterr().out, CHOSEN)
    assert main(["solve", path, "--accuracy", "height=1e-3", "--accuracy-of", "limit"]) == 0
    triangles = int(re.search(r"\d+(?= triangles)", capsys.readouterr().out)[0])
    told = int(re.search(r"within\n  0.001 it takes (\d+)\.", page)[1])
    assert triangles == pytest.approx(told, rel=CHOSEN)


@pytest.mark.nightly
def test_the_families_of_panels_and_the_theorem_of_the_roof(roof):
    surface = designed(roof(0.7)).surface
    fewer = pcmc.fewer_families(surface, tolerance=0.01, change=0.02)
    assert is_printed(shown("how-to/panels-and-drawings.md"), str(fewer), CHOSEN)
    assert is_printed(shown("explanation/certificate.md"), str(pcmc.verify(surface)))


@pytest.mark.nightly
@needs_ccx
def test_how_far_the_hall_carries_a_drift_and_on_which_meshes():
    """The shares of the page under load, on four meshes; the table is that of the third."""
    script = (HOME / "docs" / "pictures" / "under_load.py").read_text(encoding="utf-8")
    script = script.partition("print(analysis)")[0].replace("from pcmc.plot import under_load\n", "")
    carried, taut = [], []
    for edge_length in (0.8, 0.6, 0.4, 0.3):
        names = {}
        exec(script.replace("edge_length=0.4", f"edge_length={edge_length}"), names)
        drift = next(case for case in names["analysis"].cases if case.name == "drift in the valley")
        carried.append(f"{100 * drift.share:.0f}")
        taut.append(f"{100 * drift.taut:.0f}")
        if edge_length == 0.4:
            assert is_printed(shown("how-to/under-load.md"), str(names["analysis"]))
    page = " ".join((HOME / "docs" / "how-to" / "under-load.md").read_text(encoding="utf-8").split())
    assert f"gives way at {', '.join(carried[:3])} and {carried[3]} % with edges of 0.8, 0.6, 0.4" in page
    assert f"Taut it is up to {', '.join(taut[:3])} and {taut[3]} %" in page
