"""The pull along each edge of a support: α + w z of the sheets there; and forces at points, apart."""

import numpy as np
import pytest
from support_cases import cables_between_walls, half_with_mirror, lens, on_unit_circle

import pcmc
from generators import spherical_cap, two_squares
from pcmc import Parameter, Patch, Plane, Surface, Target
from pcmc.certificate.forces import Forces
from pcmc.certificate.measures import largest_pull
from pcmc.certificate.quantities import figures
from pcmc.design.targets import measure
from pcmc.meshing.refinement import refine
from pcmc.plan import Divider, Plan

PULL = ["pull_x", "pull_y", "pull_z"]
SQUARE = [[0, 0], [6, 0], [6, 6], [0, 6]]
ELL = [[0, 0], [8, 0], [8, 4], [4, 4], [4, 8], [0, 8]]


def test_the_pull_of_two_sheets_along_a_held_ridge_has_its_slopes():
    """|Σ α n| of sheets that meet at an angle also changes as they turn about their common edge."""
    corners = [[0, 0, 1], [2, 0.1, 1.2], [0.3, 2, 0], [1.7, -1.5, 0.2]]
    tent = Surface(
        corners, [[0, 1, 2], [1, 0, 3]], [0, 1], [Patch("a", 1.0, 0.0), Patch("b", 2.0, 0.0)], fixed=range(4)
    )
    edge = ~tent.topology.boundary_edge

    def pull(surface):
        return largest_pull(Forces.of(surface), edge)

    found, way = pull(tent), np.random.default_rng(0).normal(size=(4, 3))
    step = 1e-6 * way
    difference = pull(tent.moved(tent.vertices + step)).value - pull(tent.moved(tent.vertices - step)).value
    assert (found.by_position * way).sum() == pytest.approx(difference / 2e-6, rel=1e-6)


def refined(surface, times=3):
    """Solved, and solved on refinements."""
    for _ in range(times):
        surface = pcmc.solve(surface, target="stationary").surface
        yield surface
        surface = refine(surface)


@pytest.mark.parametrize("outline", [SQUARE, ELL], ids=["square", "L"])
def test_a_sheet_pulls_with_its_tension_beside_corners_too(outline):
    for roof in refined(Plan(outline, [], tension=6.0, edge_length=1.0).surface()):
        found = pcmc.certify(roof)
        assert found.largest_reaction == pytest.approx(6.0, rel=1e-12)
        assert measure(roof, Target("reaction per length")).value == pytest.approx(6.0, rel=1e-12)
        assert {f.value for f in figures(roof, found) if f.quantity == "reaction per length"} == {
            found.acting.largest_per_length()
        }
        sizes = np.linalg.norm(found.pulls[PULL], axis=1)
        np.testing.assert_allclose(sizes, 6.0, rtol=1e-12)
        assert found.pulls["length"].sum() == pytest.approx(found.supports["length"].sum())
        assert found.remainder[0] == pytest.approx(np.zeros(3), abs=0.05)


def gable(weight=0.0, height=1.0, fine=False):
    """Two flat roofs of tensions 3 and 2 that rise at 45° to a held ridge; air carries their weight."""
    X = [[-1, 0, 0], [-1, 2, 0], [0, 0, 1], [0, 2, 1], [1, 0, 0], [1, 2, 0]]
    F = [[0, 2, 1], [2, 3, 1], [2, 4, 3], [4, 5, 3]]
    air = weight / 2**0.5
    patches = [Patch("west", 3.0, air, weight=weight), Patch("east", 2.0, air, weight=weight)]
    roof = Surface(np.add(X, [0.0, 0.0, height - 1.0]), F, [0, 0, 1, 1], patches, fixed=range(6))
    fine = refine(refine(roof)) if fine else roof
    ridge = np.abs(fine.vertices[:, 0]) < 1e-9
    return fine.rebuilt(fixed=fine.fixed | ridge)


@pytest.mark.parametrize("weight", [0.0, 0.5])
def test_a_held_line_between_two_sheets_takes_their_vector_sum(weight):
    roof = gable(weight, height=4.0, fine=True)
    found = pcmc.certify(roof)
    west, east = 3.0 + 4.0 * weight, 2.0 + 4.0 * weight
    ridge = found.pulls[np.isclose(found.pulls["x"], 0.0)]
    assert ridge["length"].sum() == pytest.approx(2.0)  # up to its ends on the boundary
    expected = np.array([west - east, 0.0, west + east]) / 2**0.5
    np.testing.assert_allclose(ridge[PULL], np.tile(expected, (len(ridge), 1)), atol=1e-12)
    eaves = found.pulls[np.isclose(found.pulls["z"], 3.0) & (found.pulls["x"] > 0.0)]
    np.testing.assert_allclose(
        eaves[PULL],
        np.tile((2.0 + 3.0 * weight) * np.array([1, 0, -1]) / 2**0.5, (len(eaves), 1)),
        atol=1e-12,
    )
    assert measure(roof, Target("reaction per length")).value == pytest.approx(np.linalg.norm(expected))


def test_directions_are_those_of_the_smooth_surface_in_the_limit():
    """The rim of a cap: its co-normal is (√(4α² - 1) r - n) / 2α."""
    errors = []
    for edge_length in (0.3, 0.15, 0.075):
        table = pcmc.solve(spherical_cap(edge_length, alpha=0.6)).certificate.pulls
        radial = table[["x", "y"]].to_numpy()
        radial = radial / np.linalg.norm(radial, axis=1)[:, None]
        exact = 0.6 * np.column_stack([0.44**0.5 * radial, -np.ones(len(radial))]) / 1.2
        errors.append(np.abs(table[PULL].to_numpy() - exact).max())
    assert errors[1] < 0.3 * errors[0]
    assert errors[2] < 0.35 * errors[1]
    assert errors[2] < 2e-3


def test_two_sheets_on_one_ring_pull_inwards_with_an_error_of_second_order():
    """A lens of two caps, a = p = 1: each pulls with p a / 2 = α sin θ up or down, both with 2 α cos θ in."""
    surface, alpha = lens(), 0.6
    exact, errors = 2.0 * (alpha**2 - 0.25) ** 0.5, []
    for _ in range(3):
        result = pcmc.solve(surface)
        errors.append(result.certificate.largest_reaction - exact)
        surface = refine(result.surface, 1, on_unit_circle)
    assert errors[1] < 0.3 * errors[0]
    assert errors[2] < 0.3 * errors[1]
    assert abs(errors[2]) < 3e-3 * exact


@pytest.mark.parametrize("mirror", [True, False])
def test_a_plane_takes_the_part_across_it(mirror):
    """Half a cap: its mirror plane, or a wall of glass that it slides on, pulls with all the tension."""
    half = pcmc.cut(spherical_cap(0.3, alpha=0.6), Plane(normal=(0, 1, 0), mirror=True))
    if not mirror:
        ((plane, edge),) = half.on_planes
        half = half.rebuilt(on_planes={Plane(plane.point, plane.normal): edge})
    most = []
    for surface in refined(half):
        table = pcmc.certify(surface).supports.set_index("kind")
        assert table.loc["line", "per_length_max"] == pytest.approx(0.6, rel=1e-12)
        most.append(table.loc["mirror" if mirror else "upright plane", "per_length_max"])
    assert most[-1] == pytest.approx(0.6, rel=1e-3)
    assert max(most) <= 0.6 * (1.0 + 1e-12)


def left_by_the_mesh(acting):
    """(n,3) what the forces along lines have beside the pulls of the sheets; 0 in the limit."""
    pulls = np.nan_to_num(acting.per_length) * acting.lengths[:, None]
    return np.where(acting.lengths[:, None] > 0.0, acting.along - pulls, 0.0)


def test_forces_at_points_are_those_of_cables():
    """A cable's end pulls with its force; where junctions end, what a mesh leaves goes to 0 with it."""
    sail = pcmc.solve(cables_between_walls(), target="stationary").surface
    ends = pcmc.certify(sail).supports.query("kind == 'cable end'")
    sizes = np.linalg.norm(ends[["force_x", "force_y", "force_z"]], axis=1)
    np.testing.assert_allclose(np.sort(sizes), np.sort(sail.cables[0].tension * np.ones(len(sizes))))
    left = [
        np.linalg.norm(left_by_the_mesh(Forces.of(s)), axis=1).max()
        for s in refined(two_squares(4, alpha_aux=1.0))
    ]
    assert left[1] < 0.75 * left[0]
    assert left[2] < 0.75 * left[1]


def test_vertex_forces_are_pulls_ends_of_cables_and_what_the_mesh_leaves():
    for make in (cables_between_walls, half_with_mirror):
        acting = Forces.of(pcmc.solve(make(), target="stationary").surface)
        pulls = np.nan_to_num(acting.per_length) * acting.lengths[:, None]
        on_lines = acting.lengths > 0.0
        images = [k for k, (plane, _) in enumerate(acting.surface.on_planes, 1) if plane.mirror]
        total = pulls + left_by_the_mesh(acting) + acting.points + acting.by_plane[images].sum(axis=0)
        np.testing.assert_allclose(total[on_lines], acting.reactions[on_lines], atol=1e-12)


@pytest.mark.parametrize("weight", [0.0, 0.5])
def test_the_derivative_of_the_largest_pull(weight):
    rng = np.random.default_rng(4)
    roof = gable(weight)
    roof = roof.moved(roof.vertices + 0.1 * rng.standard_normal((roof.n, 3)))
    d, target = rng.standard_normal((roof.n, 3)), Target("reaction per length")
    found = measure(roof, target)
    assert found.ties is None

    def slope(step, **values):
        ends = [roof.retensioned(**{k: {n: v + s * step for n, v in of.items()} for k, of in values.items()})
                for s in (1, -1)]  # fmt: skip
        return (measure(ends[0], target).value - measure(ends[1], target).value) / (2 * step)

    ahead, behind = (measure(roof.moved(roof.vertices + s * 1e-6 * d), target).value for s in (1, -1))
    assert (found.by_position * d).sum() == pytest.approx((ahead - behind) / 2e-6, rel=1e-6)
    assert found.by["tensions"][0] == pytest.approx(slope(1e-5, tensions={"west": 3.0}), rel=1e-6)
    assert found.by["weights"][1] == pytest.approx(slope(1e-5, weights={"east": weight}), rel=1e-6)
    assert found.by["pressures"][1] == pytest.approx(
        slope(1e-5, pressures={"east": roof.pressures[1]}), rel=1e-6
    )


def test_a_maximum_that_several_places_share_has_two_derivatives():
    """Two halls of one tension: the pull follows the one that is raised; an upright wall leans either way."""
    outline, wall = [[0, 0], [8, 0], [8, 4], [0, 4]], [Divider([[4, 0], [4, 4]], 2.0, name="wall")]
    hall = Plan(outline, wall, tension=4.0, edge_length=1.0).surface()
    surface = pcmc.solve(hall).surface
    name = surface.patches[0].name
    of = [Target("reaction per length"), Target("lean", "wall"), Target("volume")]
    table = pcmc.sensitivities(surface, of, [name, Parameter("wall")])
    assert table.index.tolist() == [
        "reaction per length as they fall",
        "reaction per length as they grow",
        "lean of wall as they fall",
        "lean of wall as they grow",
        "volume",
    ]
    fall, grow = table[table.columns[0]].iloc[:2]
    assert (fall, grow) == (pytest.approx(0.0, abs=1e-9), pytest.approx(1.0))
    for side, column in ((-1.0, "as they fall"), (1.0, "as they grow")):
        for quantity in ("reaction per length", "lean of wall"):
            changed = pcmc.solve(surface.retensioned({name: 4.0 + side * 1e-3}), tolerance=1e-12).surface
            target = of[0] if quantity.startswith("reaction") else of[1]
            there = measure(changed, target).value - measure(surface, target).value
            found = table.loc[f"{quantity} {column}"].iloc[0]
            assert side * there / 1e-3 == pytest.approx(found, rel=1e-2, abs=1e-6)


def test_a_drawn_line_inside_a_sheet_is_held_up_to_its_end_on_the_boundary():
    plan = Plan(SQUARE, [], tension=6.0, edge_length=1.0, supports=[[[3, 0, 0], [3, 3, 1]]])
    for roof in refined(plan.surface(), 2):
        table = pcmc.certify(roof).supports
        assert sorted(table["length"]) == pytest.approx([10.0**0.5, 24.0])
        assert table["name"].tolist() == ["patch 1", "patch 1, inside"]
        assert table["per_length_max"].max() <= 12.0 * (1.0 + 1e-12)
