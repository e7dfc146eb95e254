"""The command equilibria: what it prints and writes, and what it refuses."""

import pandas as pd
import pytest

import pcmc
from generators import spherical_cap
from pcmc import cli
from pcmc.plan import Plan


@pytest.fixture
def cap(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pcmc.write("cap.pcmc", spherical_cap(0.35))
    return tmp_path


def test_a_table_a_diagram_and_every_surface(cap, capsys):
    outputs = [word for name in ("cap.svg", "cap.png", "cap.csv", "roof.pcmc") for word in ("-o", name)]
    assert cli.main(["equilibria", "cap.pcmc", "--starts", "0", "--axis", "energy", *outputs]) == 0
    out = capsys.readouterr().out
    assert "inflates without bound" in out
    assert "No search of this kind proves" in out
    assert out.endswith("written: cap.svg, cap.png, cap.csv, roof-1.pcmc, roof-2.pcmc\n")
    table = pd.read_csv("cap.csv")
    assert table["index"].tolist() == [0, 1]
    for number, energy in zip(table.number, table.energy, strict=True):
        assert pcmc.certify(pcmc.read(f"roof-{number}.pcmc")).energy == pytest.approx(energy, rel=1e-12)
    assert (cap / "cap.svg").read_text().startswith("<?xml")


def test_a_part_says_what_was_left_out_and_the_whole_has_it(cap, capsys):
    outline, mirrors = [[0, 0], [3, 0], [3, 4], [0, 4]], [[[3, 0], [3, 4]]]
    half = pcmc.solve(Plan(outline, edge_length=1.0, tension=3.0, mirrors=mirrors).surface()).surface
    pcmc.write("half.pcmc", half)
    given = ["equilibria", "half.pcmc", "--starts", "0", "--span", "0.9,1.1", "-o", "t.csv"]
    for more, times, said in (([], 1, "shapes that are not symmetric in mirror plane"), (["--whole"], 2, "")):
        assert cli.main([*given, *more]) == 0
        out = capsys.readouterr().out
        assert said in out
        assert ("were left out" in out) == bool(said)
        assert pd.read_csv("t.csv").energy[0] == pytest.approx(times * pcmc.energy(half), rel=1e-9)


def test_ctrl_c_before_the_first_equilibrium_is_130_and_writes_nothing(cap, monkeypatch, capsys):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("pcmc.equilibria.search.solve", stop)
    assert cli.main(["equilibria", "cap.pcmc", "-o", "cap.svg", "-o", "cap.csv"]) == 130
    assert capsys.readouterr() == ("", "pcmc: stopped\n")
    assert [path.name for path in cap.iterdir()] == ["cap.pcmc"]


def test_a_surface_found_is_not_written_over_the_one_that_is_read(cap, capsys):
    (cap / "cap.pcmc").rename(cap / "roof-1.pcmc")
    before = (cap / "roof-1.pcmc").read_bytes()
    assert cli.main(["equilibria", "roof-1.pcmc", "--starts", "0", "-o", "roof.pcmc"]) == 2
    assert "roof-1.pcmc: is read here, and is not written over" in capsys.readouterr().err
    assert (cap / "roof-1.pcmc").read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--span", "1"], "--span: expected LOW,HIGH such as 0.5,1.5, found '1'"),
        (["--span", "1.2,1.5"], "span: expected numbers below and above the present value 1"),
        (["--along", "presure"], "did you mean 'pressure'?"),
        (["--axis", "widht"], "unknown --axis 'widht'"),
        (["-o", "a.jpeg"], "a.jpeg: "),
        (["-o", "cap.pcmc", "-o", "nowhere/a.svg"], "cap.pcmc"),
    ],
)
def test_wrong_input_is_refused_in_one_line(cap, capsys, arguments, said):
    assert cli.main(["equilibria", "cap.pcmc", *arguments]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1
