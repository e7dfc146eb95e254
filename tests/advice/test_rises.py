"""Projects with a rise in place of a tension: the tension is found."""

import pytest
from refusals import refused

from pcmc import cli
from pcmc.base.errors import FileError, OptionError
from pcmc.project import load, run_project

ROUND = "[plan]\nedge_length = 1.0\noutline = {circle = {centre = [0, 0], radius = 5}}\n"
HALL = "[plan]\nedge_length = 0.9\noutline = [[0, 0], [12, 0], [12, 6], [0, 6]]\n"
SEAM = "dividers = [[[7, 0], [7, 6]]]\n"


@pytest.fixture
def given(tmp_path):
    def project(text):
        path = tmp_path / "roof.toml"
        path.write_text(text)
        return load(path)

    return project


def apex(outcome, name=None):
    surface = outcome.surface
    chosen = (
        surface.faces if name is None else surface.faces[surface.patch_of_face == surface.patch_index(name)]
    )
    return surface.vertices[chosen, 2].max()


@pytest.mark.parametrize(("key", "rise"), [("rise = 2.0", 2.0), ("apex = 1.0", 1.0), ("span_ratio = 4", 2.5)])
def test_a_cap_gets_its_tension_from_its_rise(given, key, rise):
    outcome = run_project(given(f"{ROUND}{key}\n"), use_cache=False)
    assert outcome.good
    assert apex(outcome) == pytest.approx(rise, rel=0.01)  # of the circle that the mesh holds
    assert outcome.surface.patches[0].tension == pytest.approx((25.0 + rise**2) / (4.0 * rise), rel=0.04)


def test_an_apex_above_held_gables_is_met(given):
    outline = "[[0, 0, 3], [6, 0, 6], [12, 0, 3], [12, 10, 3], [6, 10, 6], [0, 10, 3]]"
    plan = f"[plan]\nedge_length = 1.0\noutline = {outline}\ntension = 20.0\n"
    targets = '[targets]\nmeet = [{quantity = "apex", value = 6.5}]\nvary = ["patch 1"]\n'
    outcome = run_project(given(plan + targets), use_cache=False)
    assert outcome.good
    assert apex(outcome) == pytest.approx(6.5, rel=1e-6)
    assert 4.0 < outcome.surface.patches[0].tension < 5.0


@pytest.mark.parametrize("apex", [3, 2])
def test_an_apex_that_is_not_above_the_outline_is_refused(given, apex):
    """One at the outline's height ended in a division by zero, one below it was solved for in vain."""
    raised = "[plan]\noutline = [[0, 0, 3], [12, 0, 3], [12, 8, 3], [0, 8, 3]]\n"
    with pytest.raises(FileError, match=f"apex is {apex} over the plane, and the outline is at 3 and more"):
        given(f"{raised}apex = {apex}\n")


def test_an_apex_between_the_heights_of_the_outline_is_refused_before_the_solve(given, monkeypatch):
    monkeypatch.setattr("pcmc.project.designing.solve_project", None)
    project = given("[plan]\noutline = [[0, 0, 3], [12, 0, 3], [12, 8, 5], [0, 8, 5]]\napex = 4\n")
    with refused(OptionError, what="apex", found=4.0):
        run_project(project)


def test_each_patch_may_have_its_own_rise(given):
    patches = "[plan.patches]\nwest = {rise = 1.5}\neast = {apex = 1.0}\n"
    outcome = run_project(given(HALL + SEAM + patches), use_cache=False)
    assert outcome.good
    assert (apex(outcome, "west"), apex(outcome, "east")) == pytest.approx((1.5, 1.0), rel=1e-6)


HALF = """[plan]
edge_length = 0.8
outline = [[0, 0], [9, 0], [9, 10], [0, 10]]
mirrors = [[[9, 0], [9, 10]]]
dividers = [{curve = [[4, 0], [4, 10]]}]
[plan.patches]
a = {rise = 1.6}
b = {rise = 2.2}
"""
WEDGES = """[plan]
edge_length = 0.7
outline = [[0, 0], [10, 0], [9.24, 3.83], [7.07, 7.07], [3.83, 9.24], [0, 10]]
dividers = [[[0, 0], [9.24, 3.83]], [[0, 0], [7.07, 7.07]], [[0, 0], [3.83, 9.24]]]
[plan.patches]
a = {rise = 0.8, at = [7, 1]}
b = {rise = 0.9, at = [6, 4]}
c = {rise = 0.9, at = [4, 6]}
d = {rise = 0.8, at = [1, 7]}
"""


@pytest.mark.parametrize("text", [HALF, WEDGES])
def test_heights_of_parts_of_other_sizes_are_met(given, text):
    """Beside a wall that balanced the tensions of one cap over the whole, the half missed its heights; the
    wedges have no roof at tensions for their own size."""
    outcome = run_project(given(text), use_cache=False)
    assert outcome.good
    assert outcome.design.solves < 12


def test_a_typed_wall_need_not_balance_the_first_tensions_of_heights(given):
    """They are 4 and 8, those found 4 and 6: with a wall of 2 there was "no stable roof"."""
    patches = "[plan.patches]\nwest = {rise = 2.0}\neast = {rise = 1.0}\n"
    divider = "dividers = [{curve = [[9, 0], [9, 8]], wall = 2.0}]\n"
    outline = "[plan]\nedge_length = 1.0\noutline = [[0, 0], [16, 0], [16, 8], [0, 8]]\n"
    outcome = run_project(given(outline + divider + patches), use_cache=False)
    assert outcome.good
    assert (apex(outcome, "west"), apex(outcome, "east")) == pytest.approx((2.0, 1.0), rel=1e-6)


def test_one_rise_for_all_gives_them_one_tension(given, monkeypatch):
    with monkeypatch.context() as without:
        without.setattr("pcmc.plan.draft.triangulate", None)  # loading meshes nothing
        project = given(f"{HALL}{SEAM}rise = 1.2\n")
    outcome = run_project(project, use_cache=False)
    west, east, *_ = outcome.surface.patches
    assert outcome.good
    assert west.tension == east.tension


def test_a_rise_is_over_the_outline_and_an_apex_over_the_plane(given):
    high = HALL.replace(
        "[[0, 0], [12, 0], [12, 6], [0, 6]]", "[[0, 0, 2], [12, 0, 2], [12, 6, 2], [0, 6, 2]]"
    )
    for key in ("rise = 1.2", "apex = 3.2"):
        project = given(f"{high}{key}\n")
        assert [target.value for target in project.targets] == [pytest.approx(3.2)]
    with refused(FileError, what="rise"):
        given(high.replace("[12, 6, 2]", "[12, 6, 3]") + "rise = 1.2\n")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (f"{HALL}rise = 1\npressure = 0.0\n", "rise"),
        (f"{HALL}rise = -1\n", "rise"),
        (f"{HALL}rise = 1e200\n", "rise"),
        (f"{HALL}rise = 1\napex = 2\n", "rise"),
        (f"{HALL}tension = 3.0\napex = 2\n", "plan.apex"),
        (f"{HALL}tension = 3.0\nrise = 2\n", "plan.rise"),
        (f"{HALL}rise = 2\n[plan.patches]\nroof = {{tension = 3}}\n", "plan.rise"),
        (f"{HALL}[plan.patches]\nroof = {{tension = 3, rise = 1}}\n", "rise"),
        (f"{HALL}[plan.patches]\nroof = {{pressure = 1}}\n", "plan.patches.roof.tension"),
    ],
)
def test_a_rise_that_means_nothing_is_refused(given, text, what):
    with refused(FileError, what=what):
        given(text)


def test_the_command_takes_a_rise(given, tmp_path, capsys):
    path = given(f"{HALL}tension = 9.0\n").path
    assert cli.main(["solve", str(path), "--rise", "1.2", "--no-mesh-check"]) == 0
    assert "apex 1.2" in capsys.readouterr().out
    assert cli.main(["solve", str(path), "--rise", "1.2", "--apex", "2"]) == 2
    assert "--rise and --apex: give one of them" in capsys.readouterr().err
    path.write_text(path.read_text().replace("tension = 9.0", "rise = 1.5"))
    assert cli.main(["solve", str(path), "--rise", "1.2"]) == 2
    assert f"--rise: {path.name} has rise = 1.5 already; change it there" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("vary", "line"),
    [
        ('["west", "east"]', 'type vary = ["east"]'),
        ('["west"]', "remove vary and its targets"),
        (
            '["west", {patch = "west", kind = "pressure", low = 0.5}]',
            'type vary = [{patch = "west", kind = "pressure", low = 0.5}], or give',
        ),
    ],
)
def test_a_tension_is_found_for_a_rise_or_for_the_targets(tmp_path, vary, line):
    path = tmp_path / "roof.toml"
    path.write_text(
        "[plan]\nedge_length = 1.5\noutline = [[0, 0], [6, 0], [6, 4], [0, 4]]\n"
        "dividers = [[[3, 0], [3, 4]]]\n[plan.patches]\nwest = {rise = 1.0}\neast = {tension = 3.0}\n"
        f"[targets]\nmeet = [{{quantity = 'apex', of = 'east', value = 1.0}}]\nvary = {vary}\n"
    )
    with refused(FileError, what="targets.vary", where="west") as caught:
        load(path)
    assert line in str(caught.value)
    assert "give patch 'west' tension = instead of rise =" in str(caught.value)


def test_the_span_of_a_half_is_that_of_the_whole_roof(given):
    roofs = {
        "whole": "outline = [[0, 0], [12, 0], [12, 8], [0, 8]]",
        "half": "outline = [[0, 0], [6, 0], [6, 8], [0, 8]]\nmirrors = [[[6, 0], [6, 8]]]",
        "quarter": "outline = [[0, 0], [6, 0], [6, 4], [0, 4]]\n"
        "mirrors = [[[6, 0], [6, 4]], [[0, 4], [6, 4]]]",
    }
    for text in roofs.values():
        outcome = run_project(
            given(f"[plan]\nedge_length = 1.2\n{text}\nspan_ratio = 8.0\n"), use_cache=False
        )
        assert outcome.good
        assert apex(outcome) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(
    "patches", ["", "[plan.patches]\nwest = {rise = 1.0, PRESSED}\neast = {tension = 5.0, PRESSED}\n"]
)
def test_a_rise_under_suction_is_refused(given, patches):
    """Before, it ended with "a bound on the parameters is in the way"."""
    rise = SEAM + patches if patches else "rise = 1.0\nPRESSED\n"
    with pytest.raises(FileError, match="rise is for a roof that a pressure lifts, and none is left here"):
        given(HALL + rise.replace("PRESSED", "pressure = -1.0"))
