"""Project files made to hang a reader, to fill the memory, or to write where they may not."""

from __future__ import annotations

import os
import re

import pytest
from refusals import refused
from small_project import SMALL

from pcmc import cli
from pcmc.base.errors import FileError, OptionError, PlanError
from pcmc.project import load, run
from pcmc.project.start import surface_of


def project(folder, text):
    """A project file with a text."""
    path = folder / "a.toml"
    path.write_text(text, encoding="utf-8")
    return path


def with_output(line):
    return SMALL.split("[output]")[0] + f"[output]\n{line}\n"


@pytest.mark.parametrize(
    "text",
    [
        f"[plan]\noutline = {'[' * 100_000}{']' * 100_000}\n",
        f"a = {'{a=' * 100_000}1{'}' * 100_000}\n",
        f"a{'.a' * 100_000} = 1\n",
        f"[a{'.a' * 100_000}]\n",
        f"""a{'."b c"' * 1000} = 1\n""",
        f"[plan]\nedge_length = {'9' * 5000}\n",
        f"[plan]\nedge_length = {'9' * 400}\n",
        f"[plan]\noutline = [[0, {'9' * 400}]]\n",
        "#" * 5_000_000,
    ],
)
def test_absurd_projects_are_refused(tmp_path, text, capsys):
    path = project(tmp_path, text)
    with refused(FileError) as caught:
        load(path)
    assert str(caught.value).count(str(path)) == 1
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300 + len(str(path))
    assert cli.main(["solve", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("plan", ["rise = 1.0", "tension = 5.0"])
@pytest.mark.parametrize(
    ("lines", "what"),
    [
        ("outline = [[0, 0], [6, 0], [6, 1], [0, 0], [5, 5]]", "the outline"),
        ("outline = [[0, 0], [6, 0], [6, 6]]\nmirrors = [[[0, 0], [0, 1e-300]]]", "mirror 1"),
    ],
)
def test_lines_that_make_no_plan_are_refused_with_a_rise_as_without(tmp_path, plan, lines, what):
    path = project(tmp_path, f"[plan]\n{plan}\n{lines}\n")
    with refused((FileError, PlanError), what=what):
        surface_of(load(path))


ARCH = (
    "\n[structure]\nyoung = 1e6\nthickness = 0.001\n[structure.members.arch]\nyoung = 1e8\ndiameter = 0.1\n"
)
CLOTH = "[structure]\nyoung = 1e6\nthickness = 0.001\n"
FLAT = "[plan]\noutline = [[0, 0], [6, 0], [6, 4]]\ntension = 3.0\n"
HALF = FLAT + "[[plan.dividers]]\ncurve = [[3, 0], [3, 4]]\n"
FLOW = FLAT + "[solve]\nmethod = 'nesterov'\n"


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (f"mesh = 'roof.obj'\n{FLAT}", "plan"),
        (FLAT + ARCH, "member"),
        (f"mesh = 'roof.obj'{ARCH}on = ['wall 1']\nbars = [[[0, 0], [0, 0, -3]]]\n", "bars"),
        (f"{HALF}wall = false\nbottom = 'sliding'\n", "bottom"),
        (f"{HALF}member = 'arch'\n{ARCH}propped = true\n", "propped"),
        (f"{HALF}member = 'arch'\n{ARCH}strength = 1e5\n", "strength"),
        (f"{HALF}member = 'arch'\n{ARCH}kind = 'cable'\nends = 'clamped'\n", "ends"),
        (FLAT + CLOTH + "warp = [0, 1, 0]\n", "warp"),
        (FLAT + CLOTH + "patches = {roof = {warp = [0, 1, 0]}}\n", "warp"),
        (FLAT + CLOTH + "gas = true\n", "Gas.ambient"),
        (with_output("net_pattern = 'quads'"), "net_pattern"),
        (with_output("net_pattern = 'quads'\nnet_direction = 30.0"), "net_pattern"),
        (FLOW + "momentum = false\ngamma = 0.5\n", "gamma"),
        (FLOW + "line_search = false\ntau = 0.7\n", "tau"),
        (FLOW + "line_search = false\nfloor_power = 3\n", "floor_power"),
    ],
)
def test_what_a_project_would_leave_out_is_refused(tmp_path, text, what):
    with refused(FileError, what=what) as caught:
        load(project(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_an_area_of_cables_without_cables_is_refused(tmp_path):
    text = f"units = 'm'\nforce = 'kN'\n{FLAT}{CLOTH}cable_area = 1e-4\n[output]\nstructure = 'a.inp'\n"
    with refused(OptionError, what="cable_area"):
        run(project(tmp_path, text))


def test_a_warp_of_all_patches_counts_where_one_is_a_cloth(tmp_path):
    text = FLAT + CLOTH + "warp = [0, 1, 0]\npatches = {roof = {weft = 4e5, shear = 1e4}}\n"
    assert load(project(tmp_path, text)).structure.warp == [0, 1, 0]


def test_a_number_out_of_range_is_named_with_its_line(tmp_path):
    path = project(tmp_path, SMALL.replace("[solve]", f"[solve]\niterations = {'9' * 400}"))
    line = 1 + path.read_text(encoding="utf-8").split("\n").index("[solve]")
    with refused(FileError, what="solve.iterations", where=line + 1):
        load(path)


WHOLE = """
units = "m"
[plan]
edge_length = 1.0
outline = [[0, 0], [8, 0], [8, 6], [0, 6]]
plane = {point = [0, 0, 0]}
[plan.patches.west]
tension = 2.0
[plan.patches.east]
tension = 2.5
[[plan.dividers]]
curve = [[4, 0], [4, 6]]
bottom = "held"
[[plan.holes]]
curve = {circle = {centre = [6, 3], radius = 0.5}}
[[plan.cables]]
curve = [[0, 0], [4, 0]]
name = "rim"
tension = 3.0
[plan.rooms.both]
volume = 20.0
patches = ["west", "east"]
[solve]
mesh_check = false
[[remesh]]
growth = 1.3
edge_length = 0.5
[targets]
meet = [{quantity = "apex", of = "west", value = 1.0}]
vary = [{patch = "west", low = 1.0}]
[structure]
young = 1e6
thickness = 0.01
[output]
files = ["a.obj"]
"""


@pytest.mark.parametrize(
    ("key", "typed"),
    [
        ("units", "unit"),
        ("edge_length = 1.0", "edge_lenght = 1.0"),
        ("point", "pont"),
        ("tension = 2.5", "tensoin = 2.5"),
        ("bottom", "botom"),
        ("curve = [[4", "curv = [[4"),
        ("curve = {circle", "cirve = {circle"),
        ("circle", "cirlce"),
        ("centre", "center"),
        ("radius", "radios"),
        ("curve = [[0", "curves = [[0"),
        ("name", "nam"),
        ("volume", "volum"),
        ("patches =", "patchs ="),
        ("mesh_check", "meshcheck"),
        ("growth", "grow"),
        ("meet", "met"),
        ("quantity", "quantiy"),
        ("value", "valeu"),
        ("patch =", "path ="),
        ("low", "lo"),
        ("thickness", "thicknes"),
        ("files", "file"),
        ("plan.rooms", "plan.room"),
        ("targets", "target"),
    ],
)
def test_a_misspelt_key_names_the_nearest_right_one(tmp_path, key, typed):
    path = project(tmp_path, WHOLE)
    load(path)
    assert WHOLE.count(key) >= 1
    project(tmp_path, WHOLE.replace(key, typed, 1))
    right, wrong = (re.split(r"[ .]", text.removeprefix("plan."))[0] for text in (key, typed))
    with pytest.raises(FileError, match=rf"unknown .*{wrong}'; did you mean '{right}'\?"):
        load(path)


def test_a_hole_may_be_a_curve_itself(tmp_path):
    curve = "[plan]\nholes = [{circle = {centre = [2, 1.5], radius = 0.4}}]"
    assert len(load(project(tmp_path, SMALL.replace("[plan]", curve))).plan.holes) == 1


@pytest.mark.parametrize("edge", ["1e-300", "1e-9", "1e300"])
def test_edge_lengths_whose_square_is_no_float_are_refused(tmp_path, edge):
    path = project(tmp_path, SMALL.replace("edge_length = ", f"edge_length = {edge} #"))
    with refused(PlanError, what="edge_length"):
        run(path)


@pytest.mark.parametrize(
    "name", ["../x.obj", "a/../../x.obj", "/x.obj", "C:\\\\x.obj", "\\\\\\\\host\\\\x.obj", "..\\\\x.obj"]
)
@pytest.mark.parametrize("key", ["files", "picture"])
def test_output_outside_the_projects_folder_is_refused(tmp_path, name, key):
    name = name if key == "files" else name.replace(".obj", ".png")
    line = f'files = ["{name}"]' if key == "files" else f'picture = "{name}"'
    with refused(FileError, what="output") as caught:
        load(project(tmp_path, with_output(line)))
    assert "--folder" in str(caught.value)


def test_a_link_may_not_lead_output_out_of_the_folder(tmp_path):
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (inside / "link").symlink_to(outside)
    path = project(inside, with_output('files = ["link/x.obj"]'))
    with refused(FileError, what="output"):
        run(path)
    assert os.listdir(outside) == []


def test_a_file_that_is_a_link_is_replaced_and_not_followed(tmp_path):
    (tmp_path / "precious.obj").write_text("mine", encoding="utf-8")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "x.obj").symlink_to(tmp_path / "precious.obj")
    run(project(inside, with_output('files = ["x.obj"]')))
    assert (tmp_path / "precious.obj").read_text(encoding="utf-8") == "mine"
    assert not (inside / "x.obj").is_symlink()


def test_output_in_another_folder_is_the_users_to_choose(tmp_path):
    path = project(tmp_path, with_output('files = ["x.obj"]'))
    run(path, tmp_path / "elsewhere")
    assert (tmp_path / "elsewhere" / "x.obj").is_file()


@pytest.mark.parametrize("name", ["a\\u0000.obj", f"{'a' * 300}.obj"])
def test_output_names_that_no_file_can_have(tmp_path, name):
    with refused(FileError):
        run(project(tmp_path, with_output(f'files = ["{name}"]')))


@pytest.mark.parametrize("name", ["", " "])
def test_an_empty_name_of_an_output_is_called_empty(tmp_path, name):
    with refused(FileError, what="output") as caught:
        load(project(tmp_path, with_output(f'files = ["{name}"]')))
    assert "the name of an output file is empty" in str(caught.value)
