"""Sensitivities against differences and closed forms; targets met, refused, and every bad request."""

import dataclasses
import tomllib

import numpy as np
import pandas as pd
import pytest
from shapes import pyramid

import pcmc
from generators import double_bubble, joined_caps, spherical_cap, two_caps, two_squares
from pcmc import Design, Parameter, Patch, Target, meet, sensitivities
from pcmc.design import Reach
from pcmc.design.quantities import QUANTITIES, measure
from pcmc.design.sensitivity import as_parameters
from pcmc.energy import apply_supports
from pcmc.errors import OptionError, SurfaceError
from pcmc.plan import plan_from

TIGHT = {"tolerance": 1e-13, "care": 0.0}

ROOF = """
edge_length = 2.0
outline = [[0, 0], [24, 0], [24, 10], [10, 10], [10, 24], [0, 24]]
holes = [{curve = {circle = {centre = [17, 5], radius = 2.0}}}]
dividers = [
  {curve = [[7.5, 7.5], [10, 10]], wall = 3.0, bottom = "held"},
  {curve = [[7.5, 7.5], [0, 9.5096189432]], wall = 3.0, bottom = "held"},
  {curve = [[7.5, 7.5], [9.5096189432, 0]], wall = 3.0, bottom = "held"},
]
[patches]
corner = {tension = 6.0, at = [3, 3]}
north = {tension = 6.0, at = [5, 20]}
east = {tension = 6.0, at = [20, 8]}
"""


@pytest.fixture(scope="module")
def roof():
    """Three patches over an L with a courtyard, at rest."""
    return pcmc.solve(plan_from(tomllib.loads(ROOF)).surface(), **TIGHT).surface


def cap(**arguments):
    return spherical_cap(0.35, alpha=1.5, **arguments)


def changed(surface, parameter, value):
    given = {parameter.patch: value}
    tension = parameter.kind == "tension"
    return surface.retensioned(given if tension else None, None if tension else given)


def difference(surface, targets, parameter, step, **options):
    """Central difference of the quantities of re-solved surfaces, with one Richardson step."""

    def at(change):
        value = parameter.of(surface) * (1.0 + change)
        solved = pcmc.solve(changed(surface, parameter, value), **TIGHT, **options).surface
        return np.array([measure(solved, t).value for t in targets])

    one, two = ((at(h) - at(-h)) / (2 * h) for h in (step, 2 * step))
    return (4 * one - two) / 3 / parameter.of(surface)


# Quantities


@pytest.mark.parametrize(
    "target",
    [
        Target("apex", "north"), Target("height", (5, 20)), Target("height", (20.3, 8.1)),
        Target("volume"), Target("volume", "east"), Target("area"), Target("area", "wall 1"),
        Target("reaction"), Target("reaction", "north"), Target("reaction", "wall 2"),
    ],
    ids=lambda t: t.label,
)  # fmt: skip
def test_derivatives_by_position_have_taylor_slope_two(roof, target):
    rng = np.random.default_rng(1)
    direction = rng.standard_normal(roof.vertices.shape)
    found = measure(roof, target)
    slope = float((found.position * direction).sum())
    left = []
    for t in (1e-4, 1e-5):
        # fixed vertices move too: the derivative is by all positions
        moved = measure(roof.moved(roof.vertices + t * direction), target).value
        left.append(abs(moved - found.value - t * slope))
    assert left[1] < 0.02 * left[0] + 1e-13 * abs(found.value)
    assert abs(slope) > 1e-3


@pytest.mark.parametrize("kind", ["tension", "pressure"])
@pytest.mark.parametrize("name", sorted(QUANTITIES))
def test_explicit_derivatives_by_tension_and_pressure(roof, name, kind):
    target = Target(name, (5, 20) if name == "height" else "north")
    explicit = getattr(measure(roof, target), kind)
    parameter = Parameter("north", kind)
    value = parameter.of(roof)
    ahead, behind = (
        measure(changed(roof, parameter, value + d), target).value for d in (1e-5, -1e-5)
    )
    expected = 0.0 if explicit is None else explicit[roof.patch_index("north")]
    assert (ahead - behind) / 2e-5 == pytest.approx(expected, rel=1e-8, abs=1e-9)


def test_the_reaction_of_a_membrane_is_its_tension_less_half_the_pressure_of_its_rim():
    """A square of side 1 under no pressure pulls with α per length, wherever it is held."""
    side = np.linspace(0, 1, 5)
    X = np.array([[x, y, 0.0] for y in side for x in side])
    cells = [
        [5 * j + i, 5 * j + i + 1, 5 * j + i + 6, 5 * j + i + 5] for j in range(4) for i in range(4)
    ]
    F = [t for a, b, c, d in cells for t in ([a, b, c], [a, c, d])]
    rim = np.flatnonzero((X[:, :2].min(axis=1) == 0) | (X[:, :2].max(axis=1) == 1))
    flat = pcmc.Surface(X, F, [0] * 32, [Patch("floor", 3.0, 0.0)], fixed=rim)
    corner = 3.0 * np.sqrt(0.5)  # both sides' halves, at right angles, over their length
    assert measure(flat, Target("reaction", "floor")).value == pytest.approx(3.0)
    assert corner < 3.0


def test_reactions_are_the_certificates():
    """Where held vertices are no corners, also by patch; the plane's point makes no difference."""
    dome = cap()
    for point in ((0.0, 0.0, 0.0), (3.0, -1.0, 0.0)):
        moved = dataclasses.replace(dome, plane=pcmc.Plane(point))
        boundaries = pcmc.certify(moved).boundaries
        for of in (None, "cap"):
            found = measure(moved, Target("reaction", of)).value
            assert found == pytest.approx(boundaries["per_length_max"][0], rel=1e-12)


def test_reactions_at_the_parts_of_a_roof_are_the_certificates(roof):
    found = pcmc.certify(roof)
    held = found.boundaries.groupby("boundary")["per_length_max"].max()
    assert len(held) == 6
    for name, expected in held.items():
        assert measure(roof, Target("reaction", name)).value == pytest.approx(expected, rel=1e-12)
    assert measure(roof, Target("reaction")).value == pytest.approx(held.max(), rel=1e-12)


def test_heights_are_the_meshs_own(roof):
    apex = measure(roof, Target("apex", "north"))
    vertex = int(np.abs(apex.position).sum(axis=1).argmax())
    x, y, z = roof.vertices[vertex]
    assert apex.value == z
    assert measure(roof, Target("height", (x, y))).value == pytest.approx(z, abs=1e-12)
    assert measure(roof, Target("apex")).value == max(
        measure(roof, Target("apex", name)).value for name in ("corner", "north", "east")
    )


def drawn_at(surface, shift):
    return pcmc.Surface(
        surface.vertices + shift, surface.faces, surface.patch_of_face, surface.patches,
        surface.fixed, surface.on_plane, surface.plane,
    )  # fmt: skip


@pytest.mark.parametrize("make", [cap, lambda: two_caps(1.2)], ids=["cap", "two caps"])
@pytest.mark.parametrize("shift", [(1e3, -2e3, 0.0), (5e5, 5e6, 0.0)])
def test_volumes_over_the_plane_are_the_same_wherever_it_is_drawn(make, shift):
    near = make()
    far = drawn_at(near, np.array(shift))
    whole = measure(near, Target("volume"))
    found = measure(far, Target("volume"))
    assert found.value == pytest.approx(whole.value, rel=1e-7)
    assert pcmc.energy(far) == pytest.approx(pcmc.energy(near), rel=1e-7)
    free = near.free
    np.testing.assert_allclose(found.position[free], whole.position[free], atol=1e-8)


def test_a_patchs_volume_is_seen_from_the_point_of_the_plane_however_far():
    """V_i = ⅓ Σ ⟨x - p, A ν⟩ over its triangles."""
    far = drawn_at(two_caps(1.2), np.array([1e3, -2e3, 0.0]))
    target, name = Target("volume", "large"), "large"
    X = far.vertices[far.faces[far.patch_of_face == far.patch_index(name)]]
    vector = 0.5 * np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
    found = measure(far, target)
    assert found.value == pytest.approx(np.einsum("fd,fd", X.mean(axis=1), vector) / 3.0, rel=1e-10)
    direction = apply_supports(far, np.random.default_rng(2).standard_normal(far.vertices.shape))
    ahead, behind = (
        measure(far.moved(far.vertices + t * direction), target).value for t in (1e-4, -1e-4)
    )
    slope = float((found.position * direction).sum())
    assert slope == pytest.approx((ahead - behind) / 2e-4, rel=1e-6)


def test_points_are_in_the_coordinates_of_a_tilted_plane():
    frame = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    normal = frame[:, 2] * np.sign(np.linalg.det(frame))
    plane = pcmc.Plane(point=(1, 2, 3), normal=tuple(normal))
    base = pyramid()
    from pcmc.plan.curves import to_space

    tilted = pcmc.Surface(
        to_space(base.vertices, plane), base.faces, [0] * 4, base.patches, range(4), (), plane
    )
    for point in ((0.0, 0.0), (0.25, -0.1), (-0.6, 0.3)):
        here, there = (measure(s, Target("height", point)).value for s in (base, tilted))
        assert here == pytest.approx(1.0 - max(map(abs, point)))
        assert there == pytest.approx(here)


# Sensitivities


def test_sensitivities_are_the_slopes_of_resolved_surfaces(roof):
    targets = [
        Target("apex", "north"), Target("height", (20.3, 8.1)), Target("volume"),
        Target("area", "corner"), Target("area", "wall 1"), Target("reaction", "east"),
        Target("curvature", "north"),
    ]  # fmt: skip
    to = [Parameter("north"), Parameter("wall 1"), Parameter("east", "pressure")]
    table = sensitivities(roof, targets, to)
    assert list(table.index) == [t.label for t in targets]
    assert list(table.columns) == ["tension of north", "tension of wall 1", "pressure of east"]
    for parameter in to:
        expected = difference(roof, targets, parameter, 5e-4)
        found = table[parameter.label].to_numpy()
        np.testing.assert_allclose(found, expected, rtol=2e-6, atol=1e-7 * np.abs(expected).max())


def test_the_slope_of_a_caps_height_converges_with_order_two():
    """h = 2α - √(4α² - 1): dh/dα = 2 - 4α / √(4α² - 1)."""
    exact, errors = 2.0 - 2.4 / np.sqrt(0.44), []
    for edge in (0.3, 0.15):
        at_rest = pcmc.solve(spherical_cap(edge, alpha=0.6), **TIGHT).surface
        slope = sensitivities(at_rest, [Target("apex")], ["cap"]).iloc[0, 0]
        errors.append(abs(slope - exact))
    assert errors[0] / errors[1] > 3.0
    assert errors[1] < 0.05 * abs(exact)


def test_a_surface_that_nothing_holds():
    """A double bubble is a saddle and may move away; its volume's slope is defined all the same."""
    at_rest = pcmc.solve(double_bubble(0.8), target="stationary", **TIGHT).surface
    left = Parameter("left")
    expected = difference(at_rest, [Target("volume")], left, 1e-3, target="stationary")
    found = sensitivities(at_rest, [Target("volume")], [left]).to_numpy()
    np.testing.assert_allclose(found[0], expected, rtol=1e-5)


def test_a_patch_without_influence_has_slope_zero(roof):
    assert sensitivities(roof, [Target("curvature", "north")], ["east"]).iloc[0, 0] == 0.0


@pytest.mark.parametrize(
    ("of", "to"),
    [
        (Target("apex"), "roof"),
        (Target("apex"), Parameter("roof")),
        ((t for t in [Target("apex")]), (name for name in ["roof"])),
        ({"only": Target("apex")}.values(), {"roof": 1.0}),
    ],
    ids=["alone", "Parameter", "generators", "views"],
)
def test_one_quantity_and_parameter_alone_or_several_by_any_iterable(of, to):
    """h² = 1/8: dh/dα = -h (1 + h²)."""
    table = sensitivities(pyramid(height=8**-0.5), of, to)
    assert (table.index.tolist(), table.columns.tolist()) == (["apex"], ["tension of roof"])
    assert table.iloc[0, 0] == pytest.approx(-(8**-0.5) * 1.125)


def test_a_junction_pulled_off_by_more_than_its_wall_holds_is_not_at_rest():
    pinched = pcmc.solve(two_squares(6, alpha_aux=3.0), target="stationary").surface
    assert len(pcmc.certify(pinched).pinched) == 5
    assert np.isfinite(sensitivities(pinched, Target("volume"), "left").to_numpy()).all()
    with pytest.raises(SurfaceError, match=r"not at rest \(relative residual .*; solve it first"):
        sensitivities(pinched.retensioned({"wall": 1.0}), Target("volume"), "left")


# Targets met


def test_two_apexes_from_wrong_tensions(roof):
    wrong = roof.retensioned({"north": 10.0, "east": 9.0, "corner": 8.0})
    targets = [Target("apex", "north", 2.2), Target("apex", "east", 1.8)]
    design = meet(wrong, targets, ["north", "east", "corner"])
    assert isinstance(design, Design)
    assert design.met
    assert design.solves <= 15
    assert design.certificate.certified
    for target in targets:
        assert abs(measure(design.surface, target).value - target.value) < 1e-6
    assert list(design.targets["met"]) == [True, True]
    assert design.message == Reach.MET.value
    values = [
        design.surface.patches[design.surface.patch_index(n)].tension for n in ("north", "east")
    ]
    np.testing.assert_array_equal(design.parameters["value"][:2], values)
    assert len(design.history) == design.solves
    assert design.history["misfit"].iloc[-1] < 1e-6
    assert dataclasses.is_dataclass(design)


def test_two_apexes_over_a_wall_that_slides():
    """Example 2: near the goal the solver stalls on a start that is almost at rest."""
    targets = [Target("apex", "large", 3.0), Target("apex", "small", 2.0)]
    design = meet(two_caps(1.2), targets, ["large", "small"])
    assert design.met
    assert design.solves <= 15
    assert design.certificate.certified
    for target in targets:
        assert abs(measure(design.surface, target).value - target.value) < 1e-6


def test_tensions_too_low_for_any_equilibrium_are_raised_first(roof):
    design = meet(
        roof.retensioned({"north": 2.0, "east": 2.0, "corner": 2.0}), [Target("volume", None, 450.0)],
        ["north", "east", "corner"],
    )  # fmt: skip
    assert design.met
    assert measure(design.surface, Target("volume")).value == pytest.approx(450.0, rel=1e-7)


@pytest.mark.parametrize(
    "target",
    [Target("height", (0.2, 0.1), 0.3), Target("volume", "cap", 0.5), Target("area", "cap", 3.5),
     Target("curvature", "cap", 0.8), Target("volume", None, at_least=0.6)],
    ids=lambda t: t.label,
)  # fmt: skip
def test_each_quantity_as_a_target(target):
    surface = cap()
    for kind in ("tension", "pressure"):
        design = meet(surface, [target], [Parameter("cap", kind)])
        assert design.met
        found = measure(design.surface, target).value
        assert found == pytest.approx(target.nearest(found), rel=1e-7)
        assert design.solves <= 10


def test_a_limit_holds_only_where_it_binds():
    surface = cap()
    loose, tight = Target("reaction", at_most=2.0), Target("reaction", at_most=1.0)
    assert meet(surface, [loose], ["cap"]).solves == 1
    design = meet(surface, [tight], ["cap"])
    assert design.met
    assert measure(design.surface, tight).value <= 1.0 + 1e-7


def test_of_many_solutions_tensions_keep_their_ratios(roof):
    """One target, three tensions: junctions stay in balance when all change alike."""
    design = meet(roof, [Target("apex", "north", 2.5)], ["north", "east", "corner"])
    assert design.met
    change = design.parameters["value"] / design.parameters["start"]
    assert change["tension of north"] < 0.9
    assert np.ptp(change) < 0.1 * (1.0 - change.mean())


@pytest.mark.parametrize("height", [1.2, 3.0])
def test_heights_that_only_a_coarse_mesh_carries_are_met(height):
    """α h / √(1 + h²) = 1/3: at h = 1.2 the load is 1.15 times what the smooth boundary carries."""
    design = meet(pyramid(), Target("apex", "roof", height), "roof")
    assert design.met
    assert design.surface.tensions[0] == pytest.approx(
        np.sqrt(1 + height**2) / height / 3, rel=1e-6
    )


def test_points_that_are_not_worth_a_solve_are_rows_without_one():
    seen: list[pd.Series] = []
    start = cap().retensioned({"cap": 0.3})
    design = meet(start, Target("apex", None, 0.3), "cap", callback=seen.append)
    assert design.met
    status = design.history.status
    assert status[0] == "overloaded"
    assert design.history["tension of cap"][0] == 0.3
    assert design.history[["apex", "misfit"]].iloc[0].isna().all()
    assert design.solves == (status != "overloaded").sum() < len(status) == len(seen)


def test_a_height_just_below_the_limit_is_met():
    design = meet(cap(), [Target("apex", None, 1.0)], ["cap"])
    assert design.met
    assert design.solves <= 10


# Targets out of reach


def test_an_unreachable_height_is_refused_with_the_limit():
    """Caps end at the hemisphere, of height 1; on a mesh a little above, with order two."""
    above = []
    for edge in (0.35, 0.2):
        surface = spherical_cap(edge, alpha=1.5)
        limits = []
        for height in (1.2, 5.0):
            design = meet(surface, [Target("apex", "cap", height)], ["cap"])
            assert design.reach is Reach.AT_FOLD
            assert design.solves <= 15
            limit = design.targets["limit"].iloc[0]
            assert (
                f"apex of cap: wanted {height:g}, nearest reachable {limit:.6g}" in design.message
            )
            assert design.targets["found"].iloc[0] == pytest.approx(limit, rel=1e-2)
            assert design.certificate.residual < 1e-10
            limits.append(limit)
        assert limits[0] == pytest.approx(limits[1], rel=2e-4)
        assert meet(surface, [Target("apex", "cap", 0.998 * limits[0])], ["cap"]).met
        above.append(limits[0] - 1.0)
    assert 0.0 < above[1] < 0.4 * above[0]


def test_a_bound_in_the_way(roof):
    design = meet(roof, [Target("apex", "north", 9.0)], [Parameter("north", low=5.5)])
    assert design.reach is Reach.AT_BOUND
    assert design.parameters["value"].iloc[0] == 5.5
    there = pcmc.solve(roof.retensioned({"north": 5.5})).surface
    nearest = measure(there, Target("apex", "north")).value
    assert design.targets["limit"].iloc[0] == pytest.approx(nearest, rel=1e-6)


def test_targets_that_contradict_each_other():
    targets = [Target("curvature", "cap", 0.5), Target("curvature", "cap", 0.8)]
    design = meet(cap(), targets, ["cap"])
    assert design.reach is Reach.CONFLICT
    found = design.targets["found"].iloc[0]
    # least squares of (q - 0.5) / 0.5 and (q - 0.8) / 0.8
    assert found == pytest.approx((1 / 0.5 + 1 / 0.8) / (1 / 0.25 + 1 / 0.64), rel=1e-3)


def test_a_parameter_without_influence(roof):
    design = meet(roof, [Target("curvature", "north", 0.2)], ["east"])
    assert design.reach is Reach.CONFLICT
    assert design.solves == 1


def test_the_limit_of_solves():
    design = meet(cap(), [Target("apex", None, 0.9)], ["cap"], solves=2)
    assert design.reach is Reach.SOLVES
    assert design.solves == 2


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
