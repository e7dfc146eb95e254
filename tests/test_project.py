"""Project files: a whole design from one file, every key and value checked, output whole or not at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import pcmc
from pcmc.base.errors import FileError, OptionError
from pcmc.project import build, check_names, check_outputs, load, run

ROOF = Path(__file__).resolve().parent.parent / "notebooks" / "roof.toml"
SMALL = """
[plan]
edge_length = 1.0
outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
patches = {roof = {tension = 2.0}}

[solve]
method = "newton"

[output]
files = ["roof.pcmc", "roof.obj"]
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL, encoding="utf-8")
    return path


def changed(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


@pytest.mark.slow
def test_the_example_gives_certified_files_and_a_picture(tmp_path):
    assert len(ROOF.read_text(encoding="utf-8").splitlines()) <= 30
    steps = []
    outcome = run(ROOF, tmp_path / "out", steps.append)
    assert outcome.good
    assert outcome.certificate.verdict is pcmc.Verdict.STABLE
    found = sorted(p.name for p in (tmp_path / "out").iterdir())
    assert found == ["roof.3dm", "roof.glb", "roof.obj", "roof.png"]
    assert sorted(p.name for p in outcome.files) == found
    names = [p.name for p in outcome.surface.patches]
    assert names == ["corner", "north", "east", "wall 1", "wall 2", "wall 3"]
    for name in ("roof.3dm", "roof.obj", "roof.glb"):
        back = pcmc.read(tmp_path / "out" / name)
        assert sorted(p.name for p in back.patches) == sorted(names)
        assert back.m == outcome.surface.m
    assert {s.split()[0] for s in steps} >= {
        "meshing",
        "solving:",
        "certifying",
        "writing",
    }


def test_the_native_file_keeps_supports_and_tensions(small):
    outcome = run(small)
    back = pcmc.read(small.parent / "roof.pcmc")
    assert back.patches == outcome.surface.patches
    assert (back.fixed == outcome.surface.fixed).all()
    assert pcmc.certify(back).certified


def test_build_only_meshes(small):
    assert pcmc.certify(build(small)).verdict is pcmc.Verdict.NOT_CONVERGED
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]


@pytest.mark.parametrize(
    ("old", "new", "line", "near"),
    [
        ("[output]", "[outptu]", 10, "output"),
        ("edge_length", "edge_lenght", 3, "edge_length"),
        ("method =", "metod =", 8, "method"),
        ('"newton"', '"newton"\ntoleranse = 1e-9', 9, "tolerance"),
        ("files =", "file =", 11, "files"),
        ("tension =", "tensoin =", 5, "tension"),
        ("[solve]", "[[plan.holes]]\ncurve = []\nedg = 1\n[solve]", 9, "edge"),
        ("[solve]", "[[plan.dividers]]\ncurve = []\nbotom = 1\n[solve]", 9, "bottom"),
        ("[solve]", "[plan.plane]\nnormall = [0, 0, 1]\n[solve]", 8, "normal"),
    ],
)
def test_an_unknown_key_is_named_with_its_line_and_the_nearest(small, old, new, line, near):
    with pytest.raises(FileError) as caught:
        load(changed(small, old, new))
    text = str(caught.value)
    assert text.startswith(f"{small}: line {line}: unknown ")
    assert f"did you mean '{near}'?" in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[plan]", "[plan", "at line 2"),
        ('"newton"', '"newtn"', "did you mean 'newton'"),
        ('"newton"', '"newton"\niterations = -1', "iterations"),
        ("edge_length = 1.0", "edge_length = -1.0", "edge_length"),
        ("outline = [[0, 0], [4, 0], [4, 3], [0, 3]]", "", "needs an outline"),
        ('files = ["roof.pcmc", "roof.obj"]', 'files = "roof.obj"', "list of names"),
        ("files =", "picture = 3\nfiles =", "picture"),
        ("files =", 'colour = "eror"\nfiles =', "did you mean 'error'"),
        ("[output]", "[output.files]", "list of names|unknown"),
        ("[plan]", "solve = 3\n[plan]", "twice|must be a table|Cannot"),
    ],
)
def test_a_bad_value_is_told_in_a_line(small, old, new, message):
    with pytest.raises(FileError, match=message) as caught:
        load(changed(small, old, new))
    assert str(caught.value).startswith(f"{small}: ")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("dividers = 3", r"line 3: dividers must be a list, found 3"),
        (
            "holes = {curve = 3}",
            r"line 3: holes must be a list, found .*; write \[\[plan.holes\]\]",
        ),
        ('supports = "x"', r"line 3: supports must be a list"),
        ("patches = 3", r"line 3: plan\.patches must be a table, found 3"),
        ("patches = {roof = 3}", r"plan\.patches\.roof must be a table, found 3"),
        (
            'patches = {roof = {tension = 2.0, at = "b"}}',
            "'roof': at must be a point .x, y. .*found 'b'",
        ),
        ("patches = {roof = {tension = 2.0, at = 3}}", "at must be a point .* found 3"),
        ("patches = {roof = {tension = 2.0, at = [1, nan]}}", "at must be a point"),
        ('patches = {roof = {tension = "b"}}', "tension .*expected a finite number"),
        ('holes = [{curve = {circle = {centre = [1, 1], radius = "x"}}}]', "wrong kind"),
        ('dividers = [{curve = [[2, 0], [2, 3]], wall = "a"}]\ntension = 2.0', "tension"),
        ("outline = 3", "outline"),
        ('rise = "x"', "rise"),
        ("plane = {normal = 3}", "normal"),
    ],
)
def test_values_of_the_wrong_kind(tmp_path, line, message):
    path = tmp_path / "p.toml"
    rest = ["edge_length = 1.0"]
    if not line.startswith("outline"):
        rest.append("outline = [[0, 0], [4, 0], [4, 3], [0, 3]]")
    if not line.startswith(("patches", "dividers = [")):
        rest.append("patches = {roof = {tension = 2.0}}")
    path.write_text("\n".join(["[plan]", "edge = 'fixed'", line, *rest]), encoding="utf-8")
    with pytest.raises(pcmc.base.errors.PcmcError, match=message) as caught:
        build(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_section_that_is_no_table(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("plan = 3", encoding="utf-8")
    with pytest.raises(FileError, match="line 1: plan must be a table"):
        load(path)


def test_files_that_are_none(tmp_path):
    with pytest.raises(FileError, match="cannot be read"):
        load(tmp_path / "none.toml")
    (tmp_path / "p.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(FileError, match="byte 0 is not text in UTF-8; save it as that"):
        load(tmp_path / "p.toml")
    (tmp_path / "p.toml").write_text("", encoding="utf-8")
    with pytest.raises(FileError, match=r"needs a \[plan\]"):
        load(tmp_path / "p.toml")


def test_a_crossing_outline_names_the_file(small):
    changed(small, "[4, 3], [0, 3]", "[0, 3], [4, 3]")
    with pytest.raises(pcmc.base.errors.PlanError, match=r"small\.toml: "):
        build(small)


def test_nothing_is_written_when_a_later_file_fails(small, monkeypatch):
    (small.parent / "roof.pcmc").write_text("as before", encoding="utf-8")
    from pcmc.io import obj

    def broken(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(obj, "write", broken)
    with pytest.raises(FileError, match=r"roof\.obj: cannot be written \(No space left"):
        run(small)
    assert sorted(p.name for p in small.parent.iterdir()) == ["roof.pcmc", "small.toml"]
    assert (small.parent / "roof.pcmc").read_text(encoding="utf-8") == "as before"


def test_nothing_is_written_when_not_certified_unless_asked(small):
    changed(small, "tension = 2.0", "tension = 0.3")
    outcome = run(small)
    assert not outcome.good
    assert outcome.files == ()
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]
    assert len(run(small, anyway=True).files) == 2


def test_output_names_are_checked_before_any_work(tmp_path):
    (tmp_path / "a.obj").mkdir()
    with pytest.raises(FileError, match="is a folder"):
        check_outputs([tmp_path / "a.obj"])
    with pytest.raises(FileError, match="named twice"):
        check_outputs([tmp_path / "b.obj", tmp_path / "b.obj"])
    with pytest.raises(FileError, match=r"b.obk: unknown suffix .*did you mean '.obj'"):
        check_names(["b.obk"])
    with pytest.raises(FileError, match=r"b.png: .*a picture has an option of its own"):
        check_names(["b.png"])
    with pytest.raises(FileError, match=r"b.jpg: a picture is written as .png"):
        check_names([], "b.jpg")
    with pytest.raises(FileError, match="there is no folder"):
        check_outputs([tmp_path / "away" / "b.obj"])
    check_outputs([tmp_path / "away" / "b.obj"], tmp_path / "away")


def test_a_folder_that_may_not_be_written_to_is_refused_before_any_work(small, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    monkeypatch.setattr("pcmc.project.running.surface_of", None)
    with pytest.raises(FileError, match="is read-only"):
        run(small)
    with pytest.raises(FileError, match="is read-only"):
        run(small, small.parent / "new" / "one")
    with pytest.raises(FileError, match=r"small.toml is a file; the output needs a folder"):
        run(small, small / "new")
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"roof.obj"', '"roof.obk"', "roof.obk: unknown suffix '.obk'; did you mean '.obj'"),
        ("files =", 'picture = "roof.jpg"\nfiles =', "roof.jpg: a picture is written as .png"),
    ],
)
def test_names_of_output_are_told_with_the_project(small, old, new, message):
    with pytest.raises(FileError, match=message) as caught:
        load(changed(small, old, new))
    assert str(caught.value).startswith(f"{small}: ")


@pytest.mark.parametrize("text", ["[plan]\ngröße = 1", "[größe]", "[plan]\na = {süd = 1}"])
def test_letters_beyond_a_to_z_need_quotes_and_this_is_said(small, text):
    small.write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match=r"not TOML: .*letters beyond a-z stand in quotes"):
        load(small)
    small.write_text("[plan", encoding="utf-8")
    with pytest.raises(FileError, match=r"at end of document\)$"):
        load(small)
    small.write_text("# größe\nplan = ]", encoding="utf-8")
    with pytest.raises(FileError, match=r"at line 2, column 8\)$"):
        load(small)


def test_a_folder_that_is_not_there(small):
    changed(small, '"roof.obj"', '"away/roof.obj"')
    with pytest.raises(FileError, match="there is no folder"):
        run(small)
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]


REMESH = "[remesh]\nedge_length = 0.5\n\n[output]"


@pytest.mark.parametrize("when", ["before", "after"])
def test_remeshed_before_or_after_and_certified_anew(small, when):
    coarse = build(small)
    changed(small, "[output]", REMESH.replace("0.5", f'0.5\nwhen = "{when}"'))
    steps = []
    outcome = run(small, progress=steps.append)
    assert outcome.good
    assert outcome.surface.m > 2.5 * coarse.m
    assert [p.name for p in outcome.surface.patches] == ["roof"]
    back = pcmc.read(small.parent / "roof.pcmc")
    assert back.m == outcome.surface.m
    assert pcmc.certify(back).certified
    solved = [k for k, step in enumerate(steps) if step.startswith("solving")]
    remeshed = steps.index("remeshing")
    assert (solved[0] < remeshed) == (when == "after")
    assert remeshed < solved[-1]


def test_remeshed_twice_with_solves_between_and_finer_at_the_curves(small):
    twice = (
        "[[remesh]]\nedge_length = 0.7\n[[remesh]]\nedge_length = 0.7\nnear_curves = 0.25\n[output]"
    )
    steps = []
    outcome = run(changed(small, "[output]", twice), progress=steps.append)
    assert steps.count("remeshing") == 2
    assert steps.count("certifying") == 3
    surface = outcome.surface
    ends = surface.vertices[surface.topology.edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    rim = surface.topology.boundary_edge
    assert length[rim].max() < 0.3
    assert length[~rim].max() > 0.5


def test_targets_are_met_on_the_new_mesh_too(small):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "roof", value = 0.6}]\nvary = ["roof"]\n'
    outcome = run(changed(small, "[output]", aim + REMESH))
    assert outcome.good
    assert outcome.surface.m > 100
    assert outcome.surface.vertices[:, 2].max() == pytest.approx(0.6, abs=1e-6)


def test_what_is_not_certified_is_not_remeshed(small):
    changed(small, "tension = 2.0", "tension = 0.3")
    steps = []
    assert not run(changed(small, "[output]", REMESH), progress=steps.append).good
    assert "remeshing" not in steps


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[remesh]\nedge_lenght = 0.5",
            "line 11: unknown key of .remesh.*did you mean 'edge_length'",
        ),
        ("[[remesh]]\nedge_length = 1\n[[remesh]]\nwen = 1", "line 13: unknown key .*'when'"),
        ("[remesh]\nnear_curves = 0.5", "needs an edge_length"),
        (
            "[remesh]\nedge_length = -1",
            "remesh: edge_length: expected a finite number > 0, found -1",
        ),
        (
            "[remesh]\nedge_length = 'a'",
            "remesh: edge_length: expected a finite number > 0, found 'a'",
        ),
        ("[remesh]\nedge_length = 1\ngrowth = 1", "remesh: growth: expected"),
        ("[remesh]\nedge_length = 1\nwhen = 'beforre'", "did you mean 'before'"),
    ],
)
def test_bad_remeshing(small, text, message):
    with pytest.raises(FileError, match=message) as caught:
        load(changed(small, "[output]", f"{text}\n[output]"))
    assert "\n" not in str(caught.value)


def test_a_project_is_read_with_the_mark_of_windows_editors(small):
    small.write_bytes(b"\xef\xbb\xbf" + small.read_bytes())
    assert load(small).method == "newton"


def test_a_bad_view_is_refused_before_any_work(small):
    for view, message in (
        ('"diagnal"', "did you mean 'diagonal'"), ("[30]", "two angles"), ("[nan, 30]", "two angles"),
        ("3", "view: expected a name or two angles in degrees, found 3"),
        ("3", "view: expected a name or two angles in degrees, found 3"),
    ):  # fmt: skip
        text = small.read_text(encoding="utf-8")
        changed(small, "files =", f"view = {view}\nfiles =")
        with pytest.raises(FileError, match=message):
            load(small)
        small.write_text(text, encoding="utf-8")


def test_targets_are_met(small):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "roof", value = 0.6}]\nvary = ["roof"]\n\n[output]'
    outcome = run(changed(small, "[output]", aim))
    assert outcome.design is not None
    assert outcome.good
    assert outcome.surface.vertices[:, 2].max() == pytest.approx(0.6, abs=1e-6)
    assert pcmc.read(small.parent / "roof.pcmc").patches == outcome.surface.patches


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ('meet = [{quantity = "apex", value = 1.0}]', "needs both"),
        ('meet = [{of = "roof", value = 1.0}]\nvary = ["roof"]', "needs the key 'quantity'"),
        ('meet = [{quantity = "apx"}]\nvary = ["roof"]', "did you mean 'apex'"),
        ('meet = [{quantity = "apex", valu = 1.0}]\nvary = ["roof"]', "line 11: .*'value'"),
        ('meet = []\nvaryy = ["roof"]', "line 12: .*did you mean 'vary'"),
    ],
)
def test_bad_targets(small, targets, message):
    with pytest.raises(FileError, match=message):
        load(changed(small, "[output]", f"[targets]\n{targets}\n[output]"))


def test_targets_for_a_patch_that_is_not_there_and_another_method(small):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "rof", value = 0.6}]\nvary = ["roof"]\n[output]'
    changed(small, "[output]", aim)
    with pytest.raises(OptionError, match=r"small\.toml: unknown patch 'rof'; did you mean 'roof'"):
        run(small)
    changed(small, '"newton"', '"lbfgs"')
    with pytest.raises(OptionError, match="with method 'newton' only"):
        run(small)
