"""Targets: every bad request, and the search stopped on request."""

import numpy as np
import pandas as pd
import pytest
from design_cases import cap
from shapes import pyramid

import pcmc
from generators import double_bubble, joined_caps
from pcmc import Parameter, Target, meet, sensitivities
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.design import Reach
from pcmc.design.quantities import measure
from pcmc.design.sensitivity import as_parameters

# Bad requests


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Target("apx", "north"), "did you mean 'apex'"),
        (lambda: Target("height", "north"), "expected a point"),
        (lambda: Target("height", (1.0, np.nan)), "finite"),
        (lambda: Target("curvature"), "name of a patch"),
        (lambda: Target("apex", 3), "name of a patch"),
        (lambda: Target("apex", "a", "high"), "finite number"),
        (lambda: Target("apex", "a", 1.0, at_most=2.0), "not both"),
        (lambda: Target("apex", "a", at_least=3.0, at_most=2.0), "at_most 2.0 < at_least 3.0"),
        (lambda: Parameter("a", "presure"), "did you mean 'pressure'"),
        (lambda: Parameter("a", low=np.inf), "finite number"),
        (lambda: as_parameters(["a", "a"]), "given twice"),
        (lambda: as_parameters([3]), "expected a Parameter"),
        (lambda: meet(pyramid(), ["apex"], ["roof"]), "expected a Target"),
        (lambda: meet(pyramid(), [Target("apex", "rof", 1.0)], ["roof"]), "did you mean 'roof'"),
        (lambda: meet(pyramid(), [Target("apex", "roof", 1.0)], ["rof"]), "did you mean 'roof'"),
        (lambda: meet(pyramid(), [Target("apex", "roof")], ["roof"]), "give value"),
        (lambda: meet(pyramid(), [], ["roof"]), "expected a Target, or several of them, found none"),
        (lambda: meet(pyramid(), [Target("apex", None, 1.0)], []), "name of a patch.*found none"),
        (lambda: meet(pyramid(), "apex", ["roof"]), "a Target, or several of them, found 'apex'"),
        (lambda: meet(pyramid(), Target("apex", None, 1.0), 3), "or several of them, found 3"),
        (lambda: meet(pyramid(), Target("apex", None, 1.0), "roof", callback=3), "a function of a row"),
        (lambda: meet([], Target("apex", None, 1.0), "roof"), "meet: expected a Surface, found list"),
        (lambda: sensitivities([], Target("apex"), "roof"), "expected a Surface, found list"),
        (lambda: sensitivities(pyramid(), 3, "roof"), "expected a Target, or several of them, found 3"),
        (lambda: sensitivities(pyramid(), Target("apex"), ()), "name of a patch.*found none"),
        (lambda: sensitivities(pyramid(), ["apex"], "roof"), "expected a Target, found 'apex'"),
        (lambda: Parameter(3), "Parameter: expected the name of a patch, found 3"),
        (lambda: meet(pyramid(), [Target("height", (9, 9), 1.0)], ["roof"]), "no patch is over"),
        (lambda: meet(pyramid(), [Target("apex", None, 1.0)], ["roof"], solves=0), "solves"),
        (lambda: meet(pyramid(), [Target("apex", None, 1.0)], ["roof"], tolerance=0), "tolerance"),
        (lambda: meet(pyramid(), [Target("apex", None, 1.0)], ["roof"], iteratons=9), "iterations"),
        (
            lambda: meet(pyramid(), [Target("apex", None, 1.0)], [Parameter("roof", low=3, high=2)]),
            "low 3 must be less than high 2",
        ),
        (
            lambda: meet(pyramid(), [Target("apex", None, 1.0)], [Parameter("roof", low=0)]),
            "low must be > 0",
        ),
        (
            lambda: sensitivities(joined_caps(2.0), [Target("curvature", "wal")], ["wall"]),
            "not at rest",
        ),
    ],
)  # fmt: skip
def test_bad_requests_are_refused_in_one_line(make, words):
    with pytest.raises((OptionError, SurfaceError), match=words.replace("(", r"\(")) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_parameters_and_walls_of_no_tension():
    surface = joined_caps(2.0, alpha_aux=3.0).retensioned({"wall": 0.0})
    with pytest.raises(OptionError, match="tension of wall is 0 now; give low and high"):
        meet(surface, [Target("apex", "left", 1.0)], ["wall"])
    with pytest.raises(OptionError, match="a wall without tension has none"):
        measure(surface, Target("curvature", "wall"))
    with pytest.raises(OptionError, match="low must be ≥ 0"):
        Parameter("wall", low=-1.0, high=1.0).bounds(surface)


def test_nothing_held_has_no_reaction():
    with pytest.raises(OptionError, match="nothing holds"):
        measure(double_bubble(1.0), Target("reaction", "left"))


def test_no_equilibrium_to_start_from():
    with pytest.raises(SurfaceError, match="no equilibrium was found to start from"):
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
    assert design.reach is Reach.STOPPED
    assert not design.met
    assert len(design.history) == design.solves == 2
    best = design.history.loc[design.history.misfit.idxmin()]
    assert design.certificate.certified
    assert (
        design.surface.tensions[0] == best["tension of cap"] == design.parameters["value"].iloc[0]
    )
    assert design.targets["found"].iloc[0] == best["apex"] == design.surface.vertices[:, 2].max()
    assert np.isnan(design.targets["limit"].iloc[0])
    assert design.message.startswith(Reach.STOPPED.value)
    assert f"wanted 0.9, so far {best['apex']:.6g}" in design.message


def test_stopped_where_the_targets_are_met_they_are_met():
    whole = meet(cap(), Target("apex", None, 0.3), "cap")
    design = meet(cap(), Target("apex", None, 0.3), "cap", callback=stop_after(whole.solves))
    assert design.reach is Reach.MET


def interrupted(monkeypatch, count):
    """Ctrl-C in the middle of the solve of this number."""
    solves = []

    def solve(surface, method, callback=None, **options):
        solves.append(surface)

        def pressed(progress):
            raise KeyboardInterrupt

        return pcmc.solve(surface, method, pressed if len(solves) == count else callback, **options)

    monkeypatch.setattr("pcmc.design.search.solve", solve)


def test_ctrl_c_in_a_solve_ends_the_search_with_the_best_so_far(monkeypatch):
    interrupted(monkeypatch, 3)
    design = meet(cap(), Target("apex", None, 0.9), "cap")
    assert design.reach is Reach.STOPPED
    assert design.history.status.tolist() == ["converged", "converged", "stopped"]
    assert design.result.converged
    assert design.targets["misfit"].abs().iloc[0] == design.history.misfit.min()


def test_ctrl_c_between_solves_ends_the_search_with_the_best_so_far(monkeypatch):
    def pressed(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("pcmc.design.search.sensitivities", pressed)
    design = meet(cap(), Target("apex", None, 0.9), "cap")
    assert (design.reach, design.solves) == (Reach.STOPPED, 1)
    assert design.result.converged


@pytest.mark.parametrize("tension", [1.5, 0.3])
def test_stopped_before_any_equilibrium_it_returns_the_surface_given(monkeypatch, tension):
    """0.3 carries no cap: no solve is tried, and the callback stops at that row."""
    start = cap().retensioned({"cap": tension})
    interrupted(monkeypatch, 1)
    design = meet(start, Target("apex", None, 0.9), "cap", callback=stop_after(1))
    assert design.reach is Reach.STOPPED
    assert design.history.status.tolist() == ["stopped" if tension == 1.5 else "overloaded"]
    assert design.result.status.name == "STOPPED"
    np.testing.assert_array_equal(design.surface.vertices, start.vertices)
    assert design.parameters["value"].iloc[0] == design.surface.tensions[0] == tension
    assert design.targets["found"].iloc[0] == start.vertices[:, 2].max()


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
