"""Project files: a whole design from one file, every key and value checked, output whole or not at all."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import pcmc
from pcmc.base.errors import FileError, OptionError
from pcmc.project import build, check_names, check_outputs, load, reference, run, sections

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
    assert {s.split()[0] for s in steps} >= {"meshing", "solving:", "certifying", "writing"}


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
    ("old", "new", "line", "key", "near"),
    [
        ("[output]", "[outptu]", 10, "outptu", "output"),
        ("edge_length", "edge_lenght", 3, "plan.edge_lenght", "edge_length"),
        ("method =", "metod =", 8, "solve.metod", "method"),
        ('"newton"', '"newton"\ntoleranse = 1e-9', 9, "solve.toleranse", "tolerance"),
        ("files =", "file =", 11, "output.file", "files"),
        ("tension =", "tension = 1, tensoin =", 5, "plan.patches.roof.tensoin", "tension"),
        ("[solve]", "[[plan.holes]]\ncurve = []\nedg = 1\n[solve]", 9, "plan.holes.edg", "edge"),
        ("[solve]", "[[plan.dividers]]\ncurve = []\nbotom = 1\n[solve]", 9, "plan.dividers.botom", "bottom"),
        ("[solve]", "[plan.plane]\nnormall = [0, 0, 1]\n[solve]", 8, "plan.plane.normall", "normal"),
        ("[output]", "[[remesh]]\nedge_length = 1\n[[remesh]]\nwen = 1\n[output]", 13, "remesh.wen", "when"),
        ("[output]", "[targets]\nmeet = []\nvaryy = []\n[output]", 12, "targets.varyy", "vary"),
        (
            "[output]",
            '[targets]\nvary = []\nmeet = [{quantity = "apex", valu = 1}]\n[output]',
            12,
            "targets.meet.valu",
            "value",
        ),
    ],
)
def test_an_unknown_key_has_its_line_and_the_nearest_key(small, old, new, line, key, near):
    with refused(FileError, what=key, where=line, found=key.rpartition(".")[2]) as caught:
        load(changed(small, old, new))
    text = str(caught.value)
    assert text.startswith(f"{small}: line {line}: unknown ")
    assert f"did you mean {near!r}?" in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("old", "new", "line", "key"),
    [
        ("outline = [[0, 0], [4, 0], [4, 3], [0, 3]]", "", 2, "plan.outline"),
        ("tension =", "pressure =", 5, "plan.patches.roof.tension"),
        ("[output]", "[remesh]\ngrowth = 2\n[output]", 10, "remesh.edge_length"),
        ("[output]", '[targets]\nmeet = [{quantity = "apex"}]\n[output]', 10, "targets.vary"),
        ("[output]", '[targets]\nmeet = [{of = "a"}]\nvary = ["a"]\n[output]', 11, "targets.meet.quantity"),
        ("[output]", "[targets]\nmeet = []\nvary = [{low = 1}]\n[output]", 12, "targets.vary.patch"),
    ],
)
def test_a_missing_key_is_named_with_the_line_of_its_table(small, old, new, line, key):
    with refused(FileError, what=key, where=line) as caught:
        load(changed(small, old, new))
    assert f"needs the key {key.rpartition('.')[2]!r}" in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "fields"),
    [
        ("[plan]", "[plan", {"where": 2}),
        ("[plan]", "solve = 3\n[plan]", {"where": 8}),
        ('"newton"', '"newtn"', {"what": "solve.method", "where": 8, "found": "newtn"}),
        ('"newton"', '"newton"\niterations = -1', {}),
        ("edge_length = 1.0", "edge_length = -1.0", {}),
        ('["roof.pcmc", "roof.obj"]', '"roof.obj"', {"what": "output.files", "where": 11}),
        ("files =", "picture = 3\nfiles =", {"what": "output.picture", "where": 11, "found": 3}),
        ("files =", 'colour = "eror"\nfiles =', {"what": "output.colour", "found": "eror"}),
        ('"roof.obj"', '"roof.obk"', {"what": "roof.obk", "found": ".obk"}),
        ("files =", 'picture = "roof.jpg"\nfiles =', {"what": "roof.jpg"}),
        ("[output]", "[remesh]\nedge_length = -1\n[output]", {}),
        ("[output]", "[remesh]\nedge_length = 1\nwhen = 'beforre'\n[output]", {"what": "remesh.when"}),
        ("[output]", "[targets]\nmeet = []\nvary = []\n[output]", {"what": "targets.meet"}),
    ],
)
def test_a_bad_value_is_one_line_with_the_file(small, old, new, fields):
    with refused(FileError, **fields) as caught:
        load(changed(small, old, new))
    assert str(caught.value).startswith(f"{small}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("line", "key", "kind"),
    [
        ("dividers = 3", "dividers", "a list of curves or tables"),
        ("holes = {curve = 3}", "holes", "a list of curves or tables"),
        ('supports = "x"', "supports", "a list of points and curves"),
        ("patches = 3", "patches", "a table"),
        ("patches = {roof = 3}", "patches.roof", "a table"),
        ('patches = {roof = {tension = "b"}}', "patches.roof.tension", "a number"),
        ("patches = {roof = {tension = true}}", "patches.roof.tension", "a number"),
        (
            'dividers = [{curve = [[2, 0], [2, 3]], wall = "a"}]',
            "dividers.wall",
            'a number, "balanced" or false',
        ),
        ("outline = 3", "outline", "a curve"),
        ('rise = "x"', "rise", "a number"),
        ("plane = {normal = 3}", "plane.normal", "a point [x, y, z]"),
    ],
)
def test_values_of_the_wrong_kind(tmp_path, line, key, kind):
    path = tmp_path / "p.toml"
    rest = ["edge_length = 1.0"]
    if not line.startswith("outline"):
        rest.append("outline = [[0, 0], [4, 0], [4, 3], [0, 3]]")
    if not line.startswith("patches"):
        rest.append("patches = {roof = {tension = 2.0}}")
    path.write_text("\n".join(["[plan]", "edge = 'fixed'", line, *rest]), encoding="utf-8")
    with refused(FileError, what=f"plan.{key}", where=3, expected=kind) as caught:
        load(path)
    assert str(caught.value).startswith(f"{path}: line 3: plan.{key} must be {kind}, found ")
    assert ("; write [[plan.holes]]" in str(caught.value)) == (key == "holes")


@pytest.mark.parametrize(
    ("at", "key"),
    [('"b"', "plan.patches.roof.at"), ("3", "plan.patches.roof.at"), ("[1, nan]", "at"), ('["b", 2]', "at")],
)
def test_a_patch_is_at_a_point(small, at, key):
    with refused(FileError, what=key) as caught:
        load(changed(small, "tension = 2.0", f"tension = 2.0, at = {at}"))
    assert "a point [x, y] or a list of points" in str(caught.value)


def test_a_wrong_value_inside_a_curve(small):
    changed(small, "edge_length", 'holes = [{circle = {centre = [1, 1], radius = "x"}}]\nedge_length')
    with pytest.raises(FileError, match=r"hole 1: circle: radius: expected .*, found 'x'"):
        load(small)


def test_the_line_is_that_of_the_entry_with_the_wrong_value(small):
    holes = "[[plan.holes]]\ncurve = []\nedge = 'free'\n[[plan.holes]]\ncurve = []\nedge = 'fred'\n"
    with refused(FileError, what="plan.holes.edge", where=12, found="fred"):
        load(changed(small, "[solve]", f"{holes}[solve]"))


def test_the_manual_lists_every_key_that_is_read():
    from dataclasses import fields

    from pcmc.design import Parameter, Target
    from pcmc.plan import Area, Divider, Hole, Plan
    from pcmc.plot.scene import VIEWS
    from pcmc.project import Remeshing
    from pcmc.project.accuracy import AccuracyWanted
    from pcmc.project.keys import KINDS
    from pcmc.solvers import find_method
    from pcmc.surface import Plane

    classes = {
        "plan": Plan,
        "plan.patches.NAME": Area,
        "plan.dividers": Divider,
        "plan.holes": Hole,
        "plan.plane": Plane,
        "remesh": Remeshing,
        "targets.meet": Target,
        "targets.vary": Parameter,
    }
    listed = {(s.name, s.condition): s for s in sections()}
    for name, cls in classes.items():
        unused = {Area: {"name"}, Plane: {"name", "mirror"}}.get(cls, set())
        names = {f.name for f in fields(cls)} - unused
        # what Plan's lines are made from, and what stands for tensions
        names |= {Plan: {"drawing", "gap", "apex", "span_ratio"}, Area: {"rise", "apex"}}.get(cls, set())
        assert {key.name for key in listed[name, ""].keys} == names
    for method in ("newton", "nesterov", "lbfgs"):
        options = {f.name: f.default for f in fields(find_method(method).options)}
        section = listed["solve", f'method = "{method}"']
        extra = fields(AccuracyWanted) if method == "newton" else ()
        options |= {f.name: None if f.name == "accuracy" else f.default for f in extra}
        assert {key.name: key.default for key in section.keys[2:]} == options
    manual = reference()
    for section in sections():
        for key in section.keys:
            assert key.help, (section.name, key.name)
            assert KINDS[key.kind]
            assert f"| `{key.name}` | " in manual
    (view,) = (key for key in listed["output", ""].keys if key.name == "view")
    assert all(name in view.help for name in VIEWS)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(FileError, match="cannot be read"):
        load(tmp_path / "none.toml")
    (tmp_path / "p.toml").write_bytes(b"ab\xff\xfe")
    with refused(FileError, what=str(tmp_path / "p.toml"), where=2):
        load(tmp_path / "p.toml")
    (tmp_path / "p.toml").write_text("# nothing", encoding="utf-8")
    with refused(FileError, what="plan", where=1):
        load(tmp_path / "p.toml")
    (tmp_path / "p.toml").write_text("plan = 3", encoding="utf-8")
    with refused(FileError, what="plan", where=1, found=3, expected="a table"):
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
    with pytest.raises(FileError, match="is a folder; give the name of a file"):
        check_outputs([tmp_path / "a.obj"])
    with pytest.raises(FileError, match="named twice"):
        check_outputs([tmp_path / "b.obj", tmp_path / "b.obj"])
    with refused(FileError, what="b.obk", found=".obk"):
        check_names(["b.obk"])
    with pytest.raises(FileError, match=r"b.png: .*a picture has its own option"):
        check_names(["b.png"])
    with refused(FileError, what="b.jpg", found=".jpg", expected=(".png", ".svg", ".pdf")):
        check_names([], "b.jpg")
    with pytest.raises(FileError, match="there is no folder"):
        check_outputs([tmp_path / "away" / "b.obj"])
    check_outputs([tmp_path / "away" / "b.obj"], tmp_path / "away")


def test_a_folder_that_may_not_be_written_to_is_refused_before_any_work(small, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    monkeypatch.setattr("pcmc.project.running.start_of", None)
    with pytest.raises(FileError, match="is read-only"):
        run(small)
    with pytest.raises(FileError, match="is read-only"):
        run(small, small.parent / "new" / "one")
    with pytest.raises(FileError, match=r"small.toml is a file; the output needs a folder"):
        run(small, small / "new")
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]


@pytest.mark.parametrize("text", ["[plan]\ngröße = 1", "[größe]", "[plan]\na = {süd = 1}"])
def test_letters_beyond_a_to_z_need_quotes_and_this_is_said(small, text):
    small.write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match=r"not TOML: .*put names with letters beyond a-z in quotes"):
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
    twice = "[[remesh]]\nedge_length = 0.7\n[[remesh]]\nedge_length = 0.7\nnear_curves = 0.25\n[output]"
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


def test_a_project_is_read_with_the_mark_of_windows_editors(small):
    small.write_bytes(b"\xef\xbb\xbf" + small.read_bytes())
    assert load(small).method == "newton"


@pytest.mark.parametrize(
    ("view", "found"), [('"diagnal"', "diagnal"), ("[30]", [30]), ("[30, 'a']", [30, "a"]), ("3", 3)]
)
def test_a_bad_view_is_refused_before_any_work(small, view, found):
    changed(small, "files =", f"view = {view}\nfiles =")
    with pytest.raises(FileError, match=rf"view.* {re.escape(repr(found))}"):
        load(small)


def test_targets_are_met(small):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "roof", value = 0.6}]\nvary = ["roof"]\n\n[output]'
    outcome = run(changed(small, "[output]", aim))
    assert outcome.design is not None
    assert outcome.good
    assert outcome.surface.vertices[:, 2].max() == pytest.approx(0.6, abs=1e-6)
    assert pcmc.read(small.parent / "roof.pcmc").patches == outcome.surface.patches


def test_targets_for_a_patch_that_is_not_there_and_another_method(small):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "rof", value = 0.6}]\nvary = ["roof"]\n[output]'
    changed(small, "[output]", aim)
    with pytest.raises(OptionError, match=r"small\.toml: unknown patch 'rof'; did you mean 'roof'"):
        run(small)
    changed(small, '"newton"', '"lbfgs"')
    with refused(OptionError, what="solve.method", found="lbfgs"):
        run(small)
