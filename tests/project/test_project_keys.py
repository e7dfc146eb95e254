"""Project files: every key and value is checked, and an error names its line and what to type."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import ifcopenshell
import pytest
from refusals import refused
from small_project import PLACE, changed

import pcmc
from pcmc import cli
from pcmc.base.errors import FileError, OptionError, PcmcError
from pcmc.base.units import Units
from pcmc.io import Georeference
from pcmc.plan import Plan
from pcmc.project import build, load, reference, run, sections


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
        ("[solve]", '[plan.rooms]\n"a # b" = {volum = 1}\n[solve]', 8, "plan.rooms.a # b.volum", "volume"),
        ("[solve]", '[plan.rooms."a.b"]\nvolum = 1\n[solve]', 8, "plan.rooms.a.b.volum", "volume"),
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


@pytest.mark.parametrize(("own", "listed"), [("wall = 1\n", False), ("", True)])
def test_kinds_of_curves_are_listed_where_they_can_be_keys(small, own, listed):
    dividers = f"[[plan.dividers]]\n{own}points = [[2, 0], [2, 3]]\n[solve]"
    with refused(FileError, what="plan.dividers.points", found="points") as caught:
        load(changed(small, "[solve]", dividers))
    assert "Known: curve, wall" in str(caught.value)
    assert ("polyline" in str(caught.value)) is listed


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
    name = key.rpartition(".")[2]
    assert f"needs the key {name!r}, such as {name} = " in str(caught.value)


PLAN = "[plan]\noutline = [[0, 0], [6, 0], [6, 4], [0, 4]]\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "such as [plan] with outline = [[0, 0], [12, 0], [12, 8], [0, 8]] and tension = 4.0"),
        (
            "outline = [[0, 0], [6, 0], [6, 4]]",
            "unknown key of the project 'outline'; 'outline' is a key of [plan]",
        ),
        (
            PLAN + "tension = 4.0\nfiles = ['a.obj']",
            "did you mean 'holes'? 'files' is a key of [output]. Known",
        ),
        (PLAN + "units = 'mm'", "is a key of the file itself or [mesh]"),
        (
            PLAN + "[solve]\nmethod = 'lbfgs'\nlevels = 2",
            'is a key of [solve] with method = "newton". Known',
        ),
        (PLAN + "wall = 2.0", "is a key of [plan.dividers] or [mesh.patches.NAME]"),
        (PLAN + "[structure]\nuls = 1\nwidth = 1", "unknown key of [structure] 'uls'; known:"),
        (PLAN + "[[plan.dividers]]\ncurve = [[3, 0], [3, 4]]\ndiameter = 0.2", "of [structure.members.NAME]"),
        (PLAN + "[plan.patches]\nwest = {tension = 3}\nrise = 2", "of [plan] it stands above [plan.patches]"),
        (PLAN + "tension = 4,5", "numbers have a decimal point, no comma"),
        (PLAN + "[plan.patches]\nroof = {tension = 4,5}", "numbers have a decimal point, no comma"),
        (PLAN + "tension = 4 kN", "numbers have no unit behind them"),
        (PLAN + "tension: 4", "type = between a key and its value"),
        (PLAN + "edge = cable", "put a text in quotes"),
        (PLAN + "[solve]\nmesh_check = True", "write true or false in small letters"),
        (PLAN + "tension = 4\ntension = 5", "the key is there twice"),
        ("force = 'kn'\n" + PLAN, "did you mean 'kN'?"),
        (PLAN + "tension = 4.0\ncushion = true", "found True, such as cushion = 1.0"),
        (PLAN + "tension = 4.0\ndividers = [[3, 0], [3, 4]]", "[3, 0] is a point; a curve has two or more"),
        (PLAN, "a plan needs a tension, such as tension = 4.0"),
        (
            PLAN + "tension = 4.0\npatches = {roof = {tension = 3.0}}",
            "the plan has tension = 4.0 and patches with their own; leave out one of them",
        ),
        (
            PLAN + "tension = 4.0\npressure = 0.0\nedge = 'cable'",
            'line 5: the outline: edge = "cable" needs the tension of the cable, such as cable = 10.0',
        ),
        (
            PLAN + "tension = 4.0\n[[plan.holes]]\ncurve = [[1, 1], [2, 1], [2, 2]]\ncable = 8.0",
            'line 6: hole 1: cable = 8.0 is of a free edge, and this one is fixed; type edge = "cable"',
        ),
    ],
)
def test_a_first_project_is_told_what_to_type(tmp_path, text, says):
    path = tmp_path / "roof.toml"
    path.write_text(text + "\n")
    with pytest.raises(PcmcError) as caught:
        load(path)
    assert "\n" not in str(caught.value)
    assert says in str(caught.value)


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
    from pcmc.plan import Divider, Hole, PatchSpec, Plan
    from pcmc.plot.scene import VIEWS
    from pcmc.project import AccuracyWanted, Remeshing
    from pcmc.project.keys import KINDS
    from pcmc.solvers import find_method
    from pcmc.surface import Plane

    classes = {
        "plan": Plan,
        "plan.patches.NAME": PatchSpec,
        "plan.dividers": Divider,
        "plan.holes": Hole,
        "plan.plane": Plane,
        "remesh": Remeshing,
        "targets.meet": Target,
        "targets.vary": Parameter,
    }
    listed = {(s.name, s.condition): s for s in sections()}
    for name, cls in classes.items():
        unused = {PatchSpec: {"name"}, Plane: {"name", "mirror"}}.get(cls, set())
        names = {f.name for f in fields(cls)} - unused
        # what Plan's lines are made from, and what stands for tensions
        names |= {Plan: {"drawing", "gap", "apex", "span_ratio"}, PatchSpec: {"rise", "apex"}}.get(cls, set())
        assert {key.name for key in listed[name, ""].keys} == names
    for method in ("newton", "nesterov", "lbfgs"):
        options = {f.name: f.default for f in fields(find_method(method).options)}
        section = listed["solve", f'method = "{method}"']
        extra = fields(AccuracyWanted) if method == "newton" else ()
        options |= {f.name: None if f.name == "accuracy" else f.default for f in extra}
        assert {key.name: key.default for key in section.keys[4:]} == options
    manual = reference()
    for section in sections():
        for key in section.keys:
            assert key.help, (section.name, key.name)
            assert key.kind in KINDS
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


def test_editors_read_the_same_keys_from_the_schema(capsys):
    jsonschema = pytest.importorskip("jsonschema")
    assert cli.main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(tomllib.loads(Path("notebooks/roof.toml").read_text(encoding="utf-8")), schema)
    plan = {"outline": [[0, 0], [4, 0], [4, 3]], "dividers": [{"polyline": [[2, 0], [2, 3]]}]}
    jsonschema.validate({"plan": plan, "remesh": [{"edge_length": 1}]}, schema)
    wrong = [
        {"plan": {"edge_lenght": 1}},
        {"remesh": [{"when": "never"}]},
        {"targets": {"meet": [{"valu": 1}]}},
    ]
    for data in wrong:
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(data, schema)


def test_meanings_speak_of_the_file_and_not_of_python():
    for section in sections():
        for key in section.keys:
            found = re.search(r"\b(None|True|False|PatchSpec|mapping|sequence|tuple)\b", key.help)
            assert found is None, f"{section.name}.{key.name}: {key.help}"


def test_the_place_on_a_map_is_in_the_file_of_ifc_alone(small):
    changed(small, '"roof.obj"]', '"roof.obj", "roof.ifc"]\n' + PLACE)
    files = run(small).files
    model = ifcopenshell.open(next(path for path in files if path.suffix == ".ifc"))
    [conversion] = model.by_type("IfcMapConversion")
    assert (conversion.Eastings, conversion.Northings, conversion.XAxisAbscissa) == (691e3, 0.0, 1.0)


def test_a_plan_drawn_on_the_map_is_not_put_there_a_second_time(small):
    """Eastings, or a height, that it has already; in other units as well, and in what Python writes."""
    changed(small, '"roof.obj"]', '"roof.ifc"]\n' + PLACE)
    x = [round(value / 0.3048) for value in (691_010.0, 691_014.0)]
    outline = f"outline = [[{x[0]}, 7], [{x[1]}, 7], [{x[1]}, 10], [{x[0]}, 10]]"
    changed(small, "outline = [[0, 0], [4, 0], [4, 3], [0, 3]]", outline)
    small.write_text('units = "ft"\n' + small.read_text())
    twice = "eastings = 691000: the surface is at x = 691012 m itself, and would be at twice the place;"
    with pytest.raises(OptionError, match=re.escape(f"{twice} leave eastings out, or draw it near x = 0")):
        run(small)
    with pytest.raises(FileError, match=f"a.ifc: {twice}"):
        pcmc.write(
            small.parent / "a.ifc", build(small), units="ft", georeference=Georeference("EPSG:25832", 691e3)
        )
    hill = Plan([[0, 0, 518], [4, 0, 518], [4, 3, 518]], edge_length=1.0, tension=2.0).surface()
    with pytest.raises(OptionError, match=r"height = 519.5: the surface is at z = 518 m itself.*near z = 0"):
        Georeference("EPSG:25832", height=519.5).check(hill, Units("m"))


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            '"roof.obj"]',
            f'"roof.obj"]\n{PLACE}',
            'georeference: is of .ifc files; name one, such as files = ["roof',
        ),
        (
            '"roof.obj"]',
            '"roof.ifc"]\ngeoreference = {}',
            "needs the key 'crs', such as crs = \"EPSG:25832\"",
        ),
        (
            '"roof.obj"]',
            '"roof.ifc"]\ngeoreference = {crs = "25832"}',
            "line 12: output.georeference: crs: expected",
        ),
        (
            '"roof.obj"]',
            '"roof.ifc"]\ngeoreference = {crs = "EPSG:25832", east = 1}',
            "did you mean 'eastings'?",
        ),
        (
            '"roof.obj"]',
            f'"roof.ifc"]\n{PLACE}rotation = inf',
            "line 15: output.georeference: rotation: expected a finite number, found inf",
        ),
    ],
)
def test_a_place_that_counts_for_nothing_is_refused(small, old, new, line):
    with pytest.raises(FileError, match=re.escape(line)):
        load(changed(small, old, new))
