"""Quantities and their sensitivities, against differences and closed forms."""

import dataclasses

import numpy as np
import pytest
from design_cases import TIGHT, cap, changed, difference, roof_at_rest
from refusals import refused
from shapes import pyramid

import pcmc
from generators import double_bubble, spherical_cap, two_caps, two_squares
from pcmc import Parameter, Patch, Target, sensitivities
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.base.tolerances import AT_REST
from pcmc.design.targets import MEASURES, measure


@pytest.fixture
def roof():
    return roof_at_rest()


# Quantities


@pytest.mark.parametrize(
    "target",
    [
        Target("apex", "north"),
        Target("height", (5, 20)),
        Target("height", (20.3, 8.1)),
        Target("volume"),
        Target("volume", "east"),
        Target("area"),
        Target("area", "wall 1"),
    ],
    ids=lambda t: t.label,
)
def test_derivatives_by_position_have_taylor_slope_two(roof, target):
    rng = np.random.default_rng(1)
    direction = rng.standard_normal(roof.vertices.shape)
    found = measure(roof, target)
    slope = float((found.by_position * direction).sum())
    left = []
    for t in (1e-4, 1e-5):
        # fixed vertices move too: the derivative is by all positions
        moved = measure(roof.moved(roof.vertices + t * direction), target).value
        left.append(abs(moved - found.value - t * slope))
    assert left[1] < 0.02 * left[0] + 1e-13 * abs(found.value)
    assert abs(slope) > 1e-3


@pytest.mark.parametrize("kind", ["tension", "pressure"])
@pytest.mark.parametrize("name", sorted(set(MEASURES) - {"pressure", "sag", "length", "force", "margin"}))
def test_explicit_derivatives_by_tension_and_pressure(roof, name, kind):
    target = Target(name, {"height": (5, 20), "lean": "wall 1"}.get(name, "north"))
    explicit = measure(roof, target).by.get(f"{kind}s")
    parameter = Parameter("north", kind)
    value = parameter.value(roof)
    ahead, behind = (measure(changed(roof, parameter, value + d), target).value for d in (1e-5, -1e-5))
    expected = 0.0 if explicit is None else explicit[roof.patch_index("north")]
    assert (ahead - behind) / 2e-5 == pytest.approx(expected, rel=1e-8, abs=1e-9)


def test_a_flat_membrane_pulls_with_its_tension_at_its_held_boundary():
    """A square of side 1 under no pressure pulls with α per length, wherever it is held."""
    side = np.linspace(0, 1, 5)
    X = np.array([[x, y, 0.0] for y in side for x in side])
    cells = [[5 * j + i, 5 * j + i + 1, 5 * j + i + 6, 5 * j + i + 5] for j in range(4) for i in range(4)]
    F = [t for a, b, c, d in cells for t in ([a, b, c], [a, c, d])]
    rim = np.flatnonzero((X[:, :2].min(axis=1) == 0) | (X[:, :2].max(axis=1) == 1))
    flat = pcmc.Surface(X, F, [0] * 32, [Patch("floor", 3.0, 0.0)], fixed=rim)
    assert measure(flat, Target("reaction per length", "floor")).value == pytest.approx(3.0)


def test_reactions_are_the_certificates():
    """Where held vertices are no corners, also by patch; the plane's point makes no difference."""
    dome = cap()
    for point in ((0.0, 0.0, 0.0), (3.0, -1.0, 0.0)):
        moved = dataclasses.replace(dome, plane=pcmc.Plane(point))
        boundaries = pcmc.certify(moved).boundaries
        for of in (None, "cap"):
            found = measure(moved, Target("reaction per length", of)).value
            assert found == pytest.approx(boundaries["per_length_max"][0], rel=1e-12)


def test_reactions_at_the_parts_of_a_roof_are_the_certificates(roof):
    found = pcmc.certify(roof)
    held = found.boundaries.groupby("boundary")["per_length_max"].max()
    assert len(held) == 6
    for name, expected in held.items():
        assert measure(roof, Target("reaction per length", name)).value == pytest.approx(expected, rel=1e-12)
    assert measure(roof, Target("reaction per length")).value == pytest.approx(held.max(), rel=1e-12)


def test_heights_are_the_meshs_own(roof):
    apex = measure(roof, Target("apex", "north"))
    vertex = int(np.abs(apex.by_position).sum(axis=1).argmax())
    x, y, z = roof.vertices[vertex]
    assert apex.value == z
    assert measure(roof, Target("height", (x, y))).value == pytest.approx(z, abs=1e-12)
    assert measure(roof, Target("apex")).value == max(
        measure(roof, Target("apex", name)).value for name in ("corner", "north", "east")
    )


def drawn_at(surface, shift):
    return surface.rebuilt(vertices=surface.vertices + shift)


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
    np.testing.assert_allclose(found.by_position[free], whole.by_position[free], atol=1e-8)


def test_points_are_in_the_coordinates_of_a_tilted_plane():
    frame = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    normal = frame[:, 2] * np.sign(np.linalg.det(frame))
    plane = pcmc.Plane(point=(1, 2, 3), normal=tuple(normal))
    base = pyramid()
    tilted = pcmc.Surface(
        base.vertices @ plane.axes + plane.point, base.faces, [0] * 4, base.patches, range(4), (), plane
    )
    for point in ((0.0, 0.0), (0.25, -0.1), (-0.6, 0.3)):
        here, there = (measure(s, Target("height", point)).value for s in (base, tilted))
        assert here == pytest.approx(1.0 - max(map(abs, point)))
        assert there == pytest.approx(here)


# Sensitivities


def test_sensitivities_are_the_slopes_of_resolved_surfaces(roof):
    targets = [
        Target("apex", "north"),
        Target("height", (20.3, 8.1)),
        Target("volume"),
        Target("area", "corner"),
        Target("area", "wall 1"),
        Target("reaction per length", "east"),
        Target("curvature", "north"),
    ]
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
    with refused(SurfaceError, what="surface", expected=AT_REST):
        sensitivities(pinched.retensioned({"wall": 1.0}), Target("volume"), "left")


def test_a_wall_that_is_pinched_all_along_has_no_apex():
    roof = pcmc.solve(two_caps(2.4, alpha_large=6.0, alpha_small=5.0, alpha_aux=16.0)).surface
    with pytest.raises(OptionError, match="the wall is pinched all along"):
        sensitivities(roof, Target("apex", "wall"), Parameter("large"))
