"""Targets: every bad request, and the search stopped on request."""

import re

import numpy as np
import pandas as pd
import pytest
from design_cases import cap
from refusals import refused
from shapes import pyramid

import pcmc
from generators import double_bubble, hypar_roof, joined_caps, two_caps, two_squares
from pcmc import Parameter, Target, meet, sensitivities
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.base.tolerances import AT_REST
from pcmc.design import DesignStatus
from pcmc.design.targets import as_parameters, measure
from pcmc.plan import Plan

# Bad requests


APEX = Target("apex", None, 1.0)
TARGET, PARAMETER = "a Target", "a Parameter or the name of a patch"


@pytest.mark.parametrize(
    ("make", "fields"),
    [
        (lambda: Target("apx", "north"), {"what": "quantity", "found": "apx"}),
        (lambda: Target("height", "north"), {"what": "of", "found": "north"}),
        (lambda: Target("curvature"), {"what": "of", "found": None}),
        (lambda: Target("apex", 3), {"what": "of", "found": 3}),
        (lambda: Target("area", at_most=9.0, name="roof"), {"what": "name", "found": "roof"}),
        (lambda: Target("apex", "a", 1.0, at_most=2.0), {"what": "value"}),
        (
            lambda: Target("apex", "a", at_least=3.0, at_most=2.0),
            {"what": "at_most", "found": 2.0, "expected": 3.0},
        ),
        (lambda: Parameter(3), {"what": "patch", "found": 3}),
        (lambda: as_parameters(["b", "a", "a"]), {"what": "tension of a", "where": 2}),
        (lambda: as_parameters([3]), {"where": 0, "found": 3, "expected": PARAMETER}),
        (lambda: meet(pyramid(), [APEX, "apex"], "roof"), {"where": 1, "found": "apex"}),
        (lambda: meet(pyramid(), [Target("apex", "roof")], ["roof"]), {"what": "apex of roof"}),
        (lambda: meet(pyramid(), [], ["roof"]), {"found": [], "expected": TARGET}),
        (lambda: meet(pyramid(), APEX, []), {"found": [], "expected": PARAMETER}),
        (lambda: meet(pyramid(), "apex", ["roof"]), {"found": "apex", "expected": TARGET}),
        (lambda: meet(pyramid(), APEX, 3), {"found": 3, "expected": PARAMETER}),
        (lambda: meet(pyramid(), APEX, "roof", callback=3), {"what": "callback", "found": 3}),
        (lambda: meet(pyramid(), Target("height", (9, 9), 1.0), "roof"), {"found": (9.0, 9.0)}),
        (
            lambda: meet(pyramid(), APEX, Parameter("roof", low=3, high=2)),
            {"what": "high", "where": "tension of roof", "found": 2},
        ),
        (
            lambda: meet(pyramid(), APEX, Parameter("roof", low=0)),
            {"what": "low", "where": "tension of roof", "found": 0},
        ),
        (lambda: Target("height", (1.0, np.nan)), {"what": "height: y"}),
        (lambda: Target("apex", "a", "high"), {"what": "value", "where": "apex of a"}),
        (lambda: Parameter("a", low=np.inf), {"what": "low", "where": "tension of a"}),
        (lambda: meet(pyramid(), APEX, "roof", solves=0), {"what": "solves", "found": 0}),
        (lambda: meet(pyramid(), APEX, "roof", tolerance=0), {"what": "tolerance", "found": 0}),
        (lambda: sensitivities(pyramid(), 3, "roof"), {"found": 3, "expected": TARGET}),
        (lambda: sensitivities(pyramid(), APEX, ()), {"found": [], "expected": PARAMETER}),
    ],
)
def test_bad_requests_are_refused_in_one_line(make, fields):
    with refused(OptionError, **fields) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Target("apx", "north"), "did you mean 'apex'"),
        (lambda: Parameter("a", "presure"), "did you mean 'pressure'"),
        (lambda: meet(pyramid(), Target("apex", "rof", 1.0), "roof"), "did you mean 'roof'"),
        (lambda: meet(pyramid(), APEX, "rof"), "did you mean 'roof'"),
        (lambda: meet(pyramid(), APEX, "roof", iteratons=9), "did you mean 'iterations'"),
    ],
)
def test_unknown_names_are_refused_with_the_nearest_one(make, message):
    with pytest.raises(OptionError, match=message):
        make()


def test_what_is_no_surface_or_not_at_rest_has_no_design():
    with refused(SurfaceError, what="surface", found="list"):
        meet([], APEX, "roof")
    with refused(SurfaceError, what="surface", found="list"):
        sensitivities([], Target("apex"), "roof")
    with refused(SurfaceError, what="surface", expected=AT_REST) as caught:
        sensitivities(joined_caps(2.0), Target("apex"), "wall")
    assert caught.value.found > AT_REST


@pytest.mark.parametrize(("kind", "error"), [("pressure", OptionError), ("snow", SurfaceError)])
def test_what_nothing_balances_at_a_free_edge_has_no_slope(kind, error):
    """It depended on the point of Π; the roof under this snow would have been refused."""
    sail = pcmc.solve(hypar_roof(4)).surface
    with refused(error, what={"pressure": "pressure of roof"}.get(kind, "snow")):
        sensitivities(sail, Target("area", "roof"), Parameter("roof", kind))


def test_parameters_and_walls_of_no_tension():
    surface = joined_caps(2.0, alpha_aux=3.0).retensioned({"wall": 0.0})
    with refused(OptionError, what="tension of wall", found=0.0):
        meet(surface, [Target("apex", "left", 1.0)], ["wall"])
    with refused(OptionError, what="of", found="wall"):
        measure(surface, Target("curvature", "wall"))
    with refused(OptionError, what="low", where="tension of wall", found=-1.0):
        Parameter("wall", low=-1.0, high=1.0).bounds(surface)


def test_the_two_sheets_of_a_cushion_are_no_two_pressures_of_a_search():
    edges = {"edge_length": 1.0, "tension": 4.0, "cushion": 1.2}
    cushion = pcmc.solve(Plan([[0, 0], [6, 0], [6, 4], [0, 4]], **edges).surface()).surface
    sheets, aim = ["patch 1", "patch 1 below"], [Target("apex", "patch 1", 0.6)]
    with refused(OptionError, what="vary", found="pressure of patch 1 below"):
        meet(cushion, aim, [Parameter(name, "pressure") for name in sheets])
    found = meet(cushion, aim, [Parameter("patch 1", "pressure")]).surface.pressures
    assert found[0] == found[1] != 1.0
    assert meet(cushion, aim, [Parameter(sheets, "pressure")]).surface.pressures == pytest.approx(
        found, rel=1e-4
    )


def test_snow_leans_a_wall_as_much_as_pressure_the_other_way():
    """Its rows are linear in the top edge, however far a slope times one goes below Π."""
    caps = pcmc.solve(two_caps(1.2), tolerance=1e-12).surface
    lean, of = Target("lean", "wall"), [Parameter("large", kind) for kind in ("pressure", "snow")]
    pressure, snow = (sensitivities(caps, lean, one).to_numpy().ravel() for one in of)
    assert pressure == pytest.approx(-snow[::-1], rel=1e-9)


@pytest.mark.parametrize("x", ["a", None, True])
def test_a_place_that_is_no_number_is_shown_as_given(x):
    with refused(OptionError, what="height: x", found=x):
        Target("height", (x, 2.0))


def test_a_tension_may_be_0_only_where_nothing_presses_or_weighs():
    surface = joined_caps(2.0, alpha_aux=3.0)
    assert Parameter("wall", low=0.0, high=1.0).bounds(surface) == (0.0, 1.0)
    unloaded = surface.retensioned(None, {"left": 0.0})
    assert Parameter("left", low=0.0, high=1.0).bounds(unloaded) == (0.0, 1.0)
    for loaded in (surface, unloaded.retensioned(weights={"left": 0.1})):
        assert Parameter("left", low=1e-6, high=1.0).bounds(loaded) == (1e-6, 1.0)
        with refused(OptionError, what="low", where="tension of left", found=0.0):
            Parameter("left", low=0.0, high=1.0).bounds(loaded)


def test_reaction_alone_is_the_force_of_all_supports_and_no_target():
    with refused(OptionError, what="quantity", found="reaction") as caught:
        Target("reaction")
    assert "did you mean 'reaction per length'?" in str(caught.value)


def test_nothing_held_has_no_reaction():
    with refused(OptionError, what="of", found="left"):
        measure(double_bubble(1.0), Target("reaction per length", "left"))


def test_no_equilibrium_to_start_from():
    with refused(SurfaceError, what="surface"):
        meet(cap(), [Target("apex", None, 0.5)], [Parameter("cap", low=0.1, high=0.2)])


def test_a_callback_sees_each_solve_and_its_exceptions_pass_through():
    rows: list[pd.Series] = []
    design = meet(cap(), [Target("apex", None, 0.3)], ["cap"], callback=rows.append)
    assert len(rows) == design.solves

    class Enough(Exception):
        pass

    def stop(row: pd.Series) -> None:
        raise Enough

    with pytest.raises(Enough):
        meet(cap(), [Target("apex", None, 0.3)], ["cap"], callback=stop)


# Stopped on request


def stop_after(count, error=StopIteration):
    seen = []

    def callback(row):
        seen.append(row)
        if len(seen) == count:
            raise error

    return callback


@pytest.mark.parametrize("error", [StopIteration, KeyboardInterrupt])
def test_stopped_by_its_callback_it_returns_the_best_so_far(error):
    design = meet(cap(), Target("apex", None, 0.9), "cap", callback=stop_after(2, error))
    assert design.status is DesignStatus.STOPPED
    assert not design.met
    assert len(design.history) == design.solves == 2
    best = design.history.loc[design.history.misfit.idxmin()]
    assert design.certificate.certified
    assert design.surface.tensions[0] == best["tension of cap"] == design.parameters["value"].iloc[0]
    assert design.targets["value"].iloc[0] == best["apex"] == design.surface.vertices[:, 2].max()
    assert np.isnan(design.targets["limit"].iloc[0])
    assert design.message.startswith(DesignStatus.STOPPED.value)
    assert f"wanted 0.9, so far {best['apex']:.6g}" in design.message


def test_stopped_where_the_targets_are_met_they_are_met():
    whole = meet(cap(), Target("apex", None, 0.3), "cap")
    design = meet(cap(), Target("apex", None, 0.3), "cap", callback=stop_after(whole.solves))
    assert design.status is DesignStatus.MET


def interrupted(monkeypatch, count):
    """Ctrl-C in the middle of the solve of this number."""
    solves = []

    def solve(surface, method, callback=None, **options):
        solves.append(surface)

        def pressed(progress):
            raise KeyboardInterrupt

        return pcmc.solve(surface, method, pressed if len(solves) == count else callback, **options)

    monkeypatch.setattr("pcmc.design.search.solve_once", solve)


def test_ctrl_c_in_a_solve_ends_the_search_with_the_best_so_far(monkeypatch):
    interrupted(monkeypatch, 3)
    design = meet(cap(), Target("apex", None, 0.9), "cap")
    assert design.status is DesignStatus.STOPPED
    assert design.history.status.tolist() == ["converged", "converged", "stopped"]
    assert design.result.converged
    assert design.targets["misfit"].abs().iloc[0] == design.history.misfit.min()


def test_ctrl_c_between_solves_ends_the_search_with_the_best_so_far(monkeypatch):
    def pressed(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("pcmc.design.search.slopes", pressed)
    design = meet(cap(), Target("apex", None, 0.9), "cap")
    assert (design.status, design.solves) == (DesignStatus.STOPPED, 1)
    assert design.result.converged


@pytest.mark.parametrize("tension", [1.5, 0.3])
def test_stopped_before_any_equilibrium_it_returns_the_surface_given(monkeypatch, tension):
    """0.3 carries no cap: no solve is tried, and the callback stops at that row."""
    start = cap().retensioned({"cap": tension})
    interrupted(monkeypatch, 1)
    design = meet(start, Target("apex", None, 0.9), "cap", callback=stop_after(1))
    assert design.status is DesignStatus.STOPPED
    assert design.history.status.tolist() == ["stopped" if tension == 1.5 else "overloaded"]
    assert design.result.status.name == "STOPPED"
    np.testing.assert_array_equal(design.surface.vertices, start.vertices)
    assert design.parameters["value"].iloc[0] == design.surface.tensions[0] == tension
    assert design.targets["value"].iloc[0] == start.vertices[:, 2].max()


def test_a_command_stopped_while_it_meets_targets_ends(tmp_path):
    from pcmc import project

    file = tmp_path / "roof.toml"
    file.write_text(
        """
        [plan]
        edge_length = 1.0
        outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
        patches = {roof = {tension = 2.0}}
        [targets]
        meet = [{quantity = "apex", value = 0.6}]
        vary = ["roof"]
        [output]
        files = ["roof.pcmc"]
        """
    )

    def pressed(words):
        if words.startswith("meeting"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        project.run(file, progress=pressed)
    assert [path.name for path in tmp_path.iterdir()] == ["roof.toml"]


def test_too_few_parameters_are_counted_and_others_named():
    """Two apexes cannot follow one tension: the message names the other one that may vary."""
    surface = two_squares(4, alpha=3.0, alpha_aux=1.0)
    aims = [Target("apex", "left", 0.7), Target("apex", "right", 1.0)]
    design = meet(surface, aims, "left")
    assert design.status is DesignStatus.CONFLICT
    assert design.message.endswith(
        "2 targets need 2 parameters, and 1 may vary: add to vary, such as 'right'"
    )
    assert re.search(
        r"apex of left: wanted 0.7, nearest reachable [\d.]+, [\d.]+ % (more|less)", design.message
    )
