"""Plans: what they become, and their angles."""

import tomllib

import numpy as np
import pytest

from pcmc import Direction, Parameter, Plane, Surface, Target, Verdict, certify, follow, meet, solve
from pcmc.base.errors import PlanError, PlanWarning
from pcmc.forces.functional import patch_areas
from pcmc.meshing.planar import signed_areas, triangulate
from pcmc.meshing.quality import edge_lengths, minimum_angle
from pcmc.plan import Divider, Hole, PatchSpec, Plan, draft, patch_names, plan_from
from pcmc.plan.build import dome, harmonic_heights
from pcmc.plan.draft import drafted
from pcmc.surface.curves import arc, bezier, circle, join, polyline
from pcmc.surface.pieces import to_local
from pcmc.surface.topology import POINT

BOX = [[0, 0], [20, 0], [20, 12], [0, 12]]

L_WITH_COURTYARD = """
edge_length = 1.0
outline = [[0, 0], [24, 0], [24, 10], [10, 10], [10, 24], [0, 24]]

[[holes]]
name = "courtyard"
curve = {circle = {centre = [17, 5], radius = 2.0}}

[[dividers]]
curve = [[7.5, 7.5], [10, 10]]
bottom = "held"

[[dividers]]
curve = [[7.5, 7.5], [0, 9.5096189432]]
bottom = "held"

[[dividers]]
curve = [[7.5, 7.5], [9.5096189432, 0]]
bottom = "held"

[patches]
corner = {tension = 6.0, at = [3, 3]}
north = {tension = 6.0, at = [5, 20]}
east = {tension = 6.0, at = [20, 8]}
"""


def names(surface: Surface) -> list[str]:
    return [patch.name for patch in surface.patches]


def vertices_of(surface: Surface, name: str) -> np.ndarray:
    return np.unique(surface.faces[surface.patch_of_face == surface.patch_index(name)])


def plan_area(surface: Surface, name: str) -> float:
    """Area of a patch's projection along z."""
    X = surface.vertices[surface.faces[surface.patch_of_face == surface.patch_index(name)]]
    return 0.5 * float(np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])[:, 2].sum())


@pytest.mark.parametrize("h", [2.0, 1.0, 0.5])
def test_an_l_with_a_courtyard_and_three_walls_at_120_degrees(h):
    plan = plan_from({**tomllib.loads(L_WITH_COURTYARD), "edge_length": h})
    surface = plan.surface()
    assert names(surface) == ["corner", "north", "east", "wall 1", "wall 2", "wall 3"]
    assert minimum_angle(surface) > 24.0
    top = surface.topology
    walls = [c for c in top.junctions if all(k >= 3 for k in c.sheets)]
    assert len(walls) == 1  # the vertical line that the walls share
    assert walls[0].sheets == (3, 4, 5)
    X = surface.vertices
    np.testing.assert_allclose(X[walls[0].vertices, :2], 7.5)
    tops = [c for c in top.junctions if c.sheets != (3, 4, 5)]
    assert sorted(c.sheets for c in tops) == [(0, 1, 4), (0, 2, 5), (1, 2, 3)]
    centre = np.flatnonzero(np.isin(top.vertex_kind, POINT) & (top.on_junction & surface.free))
    peak = centre[np.argmax(X[centre, 2])]
    apart = [c.vertices[1] if c.vertices[0] == peak else c.vertices[-2] for c in tops]
    along = X[apart, :2] - 7.5
    angle = np.sort(np.degrees(np.arctan2(along[:, 1], along[:, 0])))
    np.testing.assert_allclose(np.diff(angle), 120.0, atol=1e-6)
    quarter = plan_area(surface, "corner")
    assert quarter == pytest.approx(7.5 * 9.5096189432)
    n = 2 * np.count_nonzero(np.linalg.norm(X[:, :2] - [17, 5], axis=1) < 2.0 + 1e-9)
    total = sum(plan_area(surface, name) for name in ("corner", "north", "east"))
    assert total == pytest.approx(24 * 10 + 14 * 10 - n * np.sin(4 * np.pi / n), rel=1e-9)
    held = surface.fixed & (np.abs(X[:, 2]) < 1e-12)
    assert (surface.fixed == held).all()
    assert not surface.on_plane.any()
    lengths = edge_lengths(surface)
    assert np.mean(lengths) == pytest.approx(h, rel=0.2)


@pytest.mark.nightly
def test_the_names_of_patches_need_no_mesh(monkeypatch):
    chords = [[[x, -1], [y, 13]] for x, y in ((2, 9), (4, 3), (8, 14), (13, 6), (16, 18))]
    across = [{"curve": [[-1, y], [21, y]], "cable": 1.0, "wall": None} for y in (3.1, 7.7)]
    holes = [circle([5, 5], 1.0), circle([15, 8], 1.5)]
    plans = [
        Plan(BOX, lines, cut, tension=5.0, edge_length=0.22, supports=spots)
        for lines in ([], chords[:1], chords, across, chords + across)
        for cut, spots in (([], []), (holes, [[2.5, 1.3]]), ([], [circle([10, 6], 2), [[2, 3], [3, 1]]]))
    ]
    meshed = [int(drafted(plan).mesh.region.max()) + 1 for plan in plans]
    monkeypatch.setattr(draft, "triangulate", None)
    assert [len(patch_names(plan)) for plan in plans] == meshed
    assert patch_names(plan_from(tomllib.loads(L_WITH_COURTYARD))) == ("corner", "north", "east")


def test_the_same_plan_gives_the_same_surface():
    one, two = (plan_from(tomllib.loads(L_WITH_COURTYARD)).surface() for _ in range(2))
    np.testing.assert_array_equal(one.vertices, two.vertices)
    np.testing.assert_array_equal(one.faces, two.faces)


def test_arcs_and_circles_keep_their_radius():
    half = join(polyline([[10, 0], [-10, 0]]), arc([-10, 0], [0, -10], [10, 0]))
    surface = Plan(half, [[[0, 0], [0, -10]]], tension=10.0).surface()
    X = surface.vertices[surface.fixed & ~np.isin(np.arange(surface.n), vertices_of(surface, "wall 1"))]
    round_part = X[X[:, 1] < -1e-9]
    np.testing.assert_allclose(np.linalg.norm(round_part, axis=1), 10.0, rtol=1e-12)
    assert len(surface.patches) == 3
    assert minimum_angle(surface) > 24.0


def test_boundaries_in_space_with_sloped_walls():
    """In the manner of Example 4: Bézier boundaries that leave Π, walls held along their foot."""
    sides = [
        [[0, 0, 2], [20, -8, 12], [40, -8, 12], [60, 0, 2]],
        [[60, 0, 2], [66, 10, 8], [66, 20, 8], [60, 30, 2]],
        [[60, 30, 2], [40, 38, 14], [20, 38, 14], [0, 30, 2]],
        [[0, 30, 2], [-6, 20, 8], [-6, 10, 8], [0, 0, 2]],
    ]
    outline = join(*(bezier(side) for side in sides))
    dividers = [
        Divider(bezier([[20, -8], [16, 15], [20, 40]]), 10.0, bottom="sloped"),
        Divider([[42, -9], [42, 40]], 10.0, bottom="sloped", name="east wall"),
    ]
    surface = Plan(outline, dividers, tension=30.0, edge_length=2.5).surface()
    assert names(surface) == ["patch 1", "patch 2", "patch 3", "wall 1", "east wall"]
    assert minimum_angle(surface) > 24.0
    assert not surface.on_plane.any()
    rim = surface.fixed.copy()
    rim[vertices_of(surface, "wall 1")] = rim[vertices_of(surface, "east wall")] = False
    boundary = outline.at(np.linspace(0, 4, 20001))
    gap = np.linalg.norm(surface.vertices[rim][:, None] - boundary[None], axis=2).min(axis=1)
    assert gap.max() < 0.007
    assert rim.sum() > 60
    east = vertices_of(surface, "east wall")
    np.testing.assert_allclose(surface.vertices[east, 0], 42.0)


def test_raised_boundary_has_posts_at_the_walls_ends():
    high = [[0, 0, 2], [20, 0, 3], [20, 12, 4], [0, 12, 2]]
    wall = Divider([[10, 0], [10, 12]], bottom="sliding")
    surface = Plan(high, [wall], tension=10.0, edge_length=1.5).surface()
    wall = vertices_of(surface, "wall 1")
    X = surface.vertices
    end = wall[np.abs(X[wall, 1]) < 1e-9]
    assert surface.fixed[end].all()
    np.testing.assert_allclose([X[end, 2].min(), X[end, 2].max()], [0.0, 2.5])
    foot = wall[(np.abs(X[wall, 2]) < 1e-12) & ~surface.fixed[wall]]
    assert surface.on_plane[foot].all()
    assert len(foot) == 7


def test_lines_across_a_hole_or_beyond_the_outline_are_left_out():
    cross = [[[10, -1], [10, 13]], [[-1, 6], [21, 6]]]
    surface = Plan(BOX, cross, [circle([10, 6], 2)], tension=10.0).surface()
    assert names(surface)[-2:] == ["wall 1", "wall 2"]
    assert len(surface.patches) == 6
    inside = np.linalg.norm(surface.vertices[:, :2] - [10, 6], axis=1)
    assert inside.min() > 2.0 - 1e-12


def test_a_free_hole_rises_and_its_walls_end_free():
    wall = Divider([[10, 0], [10, 12]], bottom="sliding")
    plan = Plan(BOX, [wall], [Hole(circle([10, 6], 2), "free")], tension=10.0)
    with pytest.warns(PlanWarning, match=r"nothing holds hole 1 at .* \(12 such vertices\)"):
        surface = plan.surface()
    X = surface.vertices
    edge = np.abs(np.linalg.norm(X[:, :2] - [10, 6], axis=1) - 2.0) < 1e-9
    top = edge & (X[:, 2] > 0.1)
    assert surface.free[top].all()
    assert surface.on_plane[edge & ~top].all()
    assert (edge & ~top).sum() == 2


def test_a_closed_divider():
    surface = Plan(circle([0, 0], 10), [circle([2, 0], 5)], tension=10.0).surface()
    assert names(surface) == ["patch 1", "patch 2", "wall 1"]
    wall = surface.topology.junctions
    assert all(c.sheets == (0, 1, 2) for c in wall)
    assert not surface.on_plane.any()  # a bottom is held unless it is to slide
    at_rim = np.linalg.norm(surface.vertices[:, :2], axis=1) > 9.9
    assert (surface.fixed & ~at_rim).sum() == 32  # eight from each farthest point to the next
    assert minimum_angle(surface) > 24.0


def test_dividers_that_cross_share_a_line():
    surface = Plan(BOX, [[[10, 0], [10, 12]], [[0, 6], [20, 6]]], tension=10.0).surface()
    line = [c for c in surface.topology.junctions if set(c.sheets) == {4, 5}]
    assert len(line) == 1
    assert line[0].sheets == (4, 4, 5, 5)


def test_points_curves_and_edges_as_supports():
    beam = bezier([[5, 8, 1], [10, 10, 4], [15, 8, 1]])
    plan = Plan(
        BOX,
        edge="free",
        tension=10.0,
        supports=[[[0, 0], [6, 0]], [[20, 6], [20, 12], [14, 12]], [0, 12], [10, 4, 2.0], beam],
    )
    with pytest.warns(PlanWarning, match="nothing holds the outline at .* has nothing to pull"):
        surface = plan.surface()
    X = surface.vertices[surface.fixed]
    on_edge = X[(X[:, 2] == 0.0)]
    south = on_edge[on_edge[:, 1] == 0.0]
    assert south[:, 0].max() == pytest.approx(6.0)
    assert len(south) == 7
    assert len(on_edge) == 7 + 13 + 1
    assert (np.abs(X - [10, 4, 2.0]).max(axis=1) < 1e-12).sum() == 1
    middle = X[X[:, 2] > 0.0]
    gap = np.linalg.norm(middle[:, None] - beam.at(np.linspace(0, 1, 2001))[None], axis=2)
    assert (gap.min(axis=1) < 0.01).sum() == len(middle) - 1 > 8


def test_a_free_edge_with_supports_all_along_is_a_fixed_edge():
    held = Plan(BOX, edge="free", supports=[join(polyline([*BOX, BOX[0]]))], tension=10.0).surface()
    assert held.fixed.sum() == Plan(BOX, tension=10.0).surface().fixed.sum()


def test_a_roof_on_three_points_rests_on_arches_between_them():
    corners = 10.0 * np.array([[np.cos(a), np.sin(a), 0.0] for a in 2 * np.pi * np.arange(3) / 3])
    ends = list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
    arches = [arc(a, 0.55 * (a + b) + [0, 0, 4.0], b) for a, b in ends]
    roof = solve(Plan(join(*arches), edge_length=2.0, tension=9.0).surface())
    assert roof.certificate.verdict is Verdict.STABLE


def test_a_sliding_outline():
    surface = Plan(BOX, edge="sliding", supports=[[0, 0]], tension=10.0).surface()
    assert surface.fixed.sum() == 1
    assert surface.on_plane.sum() == 63


def test_seams_without_walls_and_one_patch_in_two_parts():
    dividers = [Divider([[x, 0], [x, 12]], wall=None) for x in (7, 14)]
    patches = [PatchSpec("ends", 3.0, at=[[1, 1], [19, 1]]), PatchSpec("middle", 4.0, 0.5, at=[10, 6])]
    surface = Plan(BOX, dividers, patches=patches).surface()
    assert names(surface) == ["ends", "middle"]
    assert surface.patches[1].pressure == 0.5
    assert patch_areas(surface)[0] > patch_areas(surface)[1]
    assert surface.topology.seam_edge.sum() == 24


def test_patches_without_points_go_from_left_to_right():
    dividers = [Divider([[x, 0], [x, 12]]) for x in (14, 7)]
    surface = Plan(BOX, dividers, patches={k: {"tension": 3.0} for k in "abc"}).surface()
    middle = [surface.vertices[vertices_of(surface, k), 0].mean() for k in "abc"]
    assert middle == sorted(middle)


def test_a_tilted_plane_gives_the_same_roof_turned():
    plane = Plane((1, 2, 3), (1, -1, 2))
    flat, tilted = (
        Plan(BOX, [[[10, 0], [10, 12]]], tension=10.0, plane=p).surface() for p in (Plane(), plane)
    )
    np.testing.assert_allclose(to_local(tilted.vertices, plane), flat.vertices, atol=1e-12)
    np.testing.assert_array_equal(tilted.faces, flat.faces)


def test_rise_is_the_height_of_the_initial_surface():
    plan = {"outline": BOX, "tension": 10.0, "rise": 2.5}
    assert plan_from(plan).surface().vertices[:, 2].max() == pytest.approx(2.5)


def test_heights_in_closed_form():
    angle = 2 * np.pi * np.arange(60) / 60
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring = np.arange(60)
    mesh = triangulate(rim, np.stack([ring, np.roll(ring, -1)], axis=1), 0.1)
    held = np.arange(len(mesh.points)) < 60
    radius = np.linalg.norm(mesh.points, axis=1)
    expected = 0.2 * np.maximum(1 - radius**2, 0.0) ** 0.75  # flat enough not to be limited
    found = dome(mesh.points, mesh.triangles, held, rise=0.2)
    np.testing.assert_allclose(found, expected, atol=0.01)
    full = dome(mesh.points, mesh.triangles, held)
    assert full.max() == pytest.approx(0.3, rel=0.01)
    gap = np.linalg.norm(mesh.points[:, None] - rim[None], axis=2).min(axis=1)
    assert (full <= 0.8 * gap + 1e-12).all()
    heights = np.where(held, mesh.points[:, 0] * 2 + 1, np.nan)
    base = harmonic_heights(mesh.points, mesh.triangles, heights)
    np.testing.assert_allclose(base, mesh.points[:, 0] * 2 + 1, atol=1e-12)


@pytest.mark.nightly
def test_twenty_thousand_triangles():
    surface = plan_from({**tomllib.loads(L_WITH_COURTYARD), "edge_length": 0.2}).surface()
    assert surface.m > 20_000
    assert minimum_angle(surface) > 20.0


def test_a_divider_drawn_far_beyond_the_outline_is_told_and_one_that_passes_it_a_little_is_not():
    box, line = [[0, 0], [8, 0], [8, 4], [0, 4]], [[4, -0.5], [4, 4.5]]
    silent = Plan(box, [line], tension=2.0, edge_length=1.0).surface()
    with pytest.warns(
        PlanWarning, match=r"^divider 'wall 1' ends at \(4, 40\), 36 beyond the outline; what is"
    ):
        told = Plan(box, [[line[0], [4, 40]]], tension=2.0, edge_length=1.0).surface()
    np.testing.assert_allclose(told.vertices, silent.vertices, atol=1e-12)


def test_a_cushion_is_two_caps():
    """Over a circle, of the radii 2α/p, to the second order in the edge."""
    circle, off = {"circle": {"centre": [0, 0], "radius": 3.0}}, []
    for edge in (0.8, 0.4):
        roof = solve(Plan(circle, edge_length=edge, tension=2.0, cushion=1.5).surface()).surface
        x, y, z = roof.vertices[~roof.fixed].T
        radius = np.where(z > 0.0, 4.0, 6.0)
        cap = np.sqrt(radius**2 - x**2 - y**2) - np.sqrt(radius**2 - 9.0)
        off.append(np.sqrt(np.mean((np.abs(z) - cap) ** 2)))
    assert [patch.name for patch in roof.patches] == ["patch 1", "patch 1 below"]
    assert certify(roof).certified
    assert off[1] < 0.01
    assert np.log2(off[0] / off[1]) > 1.7
    mirrors = [[[0, 0], [4, 0]], [[0, 0], [0, 3]]]
    box = Plan([[0, 0], [4, 0], [4, 3], [0, 3]], edge_length=0.5, tension=6.0, cushion=1.0, mirrors=mirrors)
    quarter = box.surface()
    for plane, on in quarter.on_planes:
        assert np.abs(plane.height(quarter.vertices[on])).max() < 1e-12
        assert (quarter.vertices[on, 2] < -1e-6).any()
    assert solve(quarter).converged


def test_the_sheets_of_a_cushion_have_one_pressure_whichever_way_it_is_given():
    circle = {"circle": {"centre": [0, 0], "radius": 3.0}}
    roof = solve(Plan(circle, edge_length=0.8, tension=2.0, cushion=1.5).surface()).surface
    upper, lower = (patch.name for patch in roof.patches)
    assert roof.retensioned(pressures={lower: 0.9}).pressures.tolist() == [0.9, 0.9]
    assert roof.retensioned(pressures={upper: 1.1, lower: 0.9}).pressures.tolist() == [1.1, 0.9]
    end = follow(roof, Direction(pressures={upper: 1.0}), 1.1).last
    assert end.pressures.tolist() == pytest.approx([1.1, 1.1])
    wanted = end.vertices[:, 2].max()
    met = meet(roof, Target("apex", upper, wanted), Parameter(upper, "pressure"))
    assert met.surface.pressures.tolist() == pytest.approx([1.1, 1.1], rel=1e-4)


@pytest.mark.parametrize(
    "more",
    [
        {"edge": "sliding"},
        {"dividers": [[[4, 0], [4, 3]]]},
        {"pressure": 0.0},
        {"supports": [[2, 1]]},
    ],
)
def test_a_cushion_needs_a_fixed_rim_and_air(more):
    plan = Plan(
        [[0, 0], [8, 0], [8, 3], [0, 3]], **{"edge_length": 0.5, "tension": 2.0, "cushion": 1.0, **more}
    )
    says = "a cushion is two sheets on one fixed rim.*; (make it|type|give|leave)"
    with pytest.raises(PlanError, match=says) as refused:
        plan.surface()
    assert "\n" not in str(refused.value)


def test_a_corner_that_touches_a_line_cuts_it():
    """A divider passes the corner of a hole without entering it: both have one vertex there."""
    hole, across = [[4, 2], [4.4, 2], [4, 2.4]], [[0, 0], [10, 6]]
    mesh = drafted(
        Plan([[0, 0], [10, 0], [10, 6], [0, 6]], [across], [hole], tension=4.0, edge_length=0.4)
    ).mesh
    A, B, C = np.moveaxis(mesh.points[mesh.triangles], 1, 0)
    longest = np.max([np.sum((B - A) ** 2, axis=1), np.sum((C - B) ** 2, axis=1)], axis=0)
    assert (signed_areas(mesh.points, mesh.triangles) > 0.05 * longest).all()
    assert mesh.region.max() == 1


def test_a_line_ends_on_an_upright_one_by_the_digits_that_were_typed():
    """The end is 1e-5 beside the slanted line; top and bottom there are in the wall's plane all the same."""
    lines = [[[17.7394, 3.2791], [11.9906, 4.7587]], [[14.0261, 4.2348], [13.7095, 0.0]]]
    dividers = [Divider(lines[0], wall=0.6, upright=True), Divider(lines[1], wall=0.7)]
    outline = [[12.01, 0], [17.72, 0], [17.72, 6.54], [12.01, 6.54]]
    surface = Plan(outline, dividers, edge_length=0.6, tension=3.0).surface()
    [(plane, mask)] = surface.on_planes
    end = np.linalg.norm(surface.vertices[:, :2] - lines[1][0], axis=1) < 1e-4
    assert end.sum() >= 2
    assert mask[end & ~surface.fixed].all()
    assert np.abs(plane.height(surface.vertices[end])).max() < 1e-12
    assert solve(surface).converged


UNEVEN = {  # rounding chose between triangles of equal worth, or between two numbers of edges
    "wall": ([[0, 0], [6.7, 0], [6.7, 13.09], [0, 13.09]], [[[0, 6.545], [6.7, 4.36]]], 0.97),
    "half edges": ([[0, 0], [12.88, 0], [12.88, 4.64], [6.44, 4.64], [6.44, 9.28], [0, 9.28]], [], 0.56),
}


@pytest.mark.parametrize("name", UNEVEN)
@pytest.mark.parametrize(("unit", "shift"), [(1000.0, 0.0), (0.3048, 0.0), (1.0, 512.0)])
def test_a_plan_has_one_mesh_in_all_units_and_places(name, unit, shift):
    outline, walls, h = UNEVEN[name]

    def built(unit, shift):
        lines = [np.multiply(line, unit) + shift for line in (outline, *walls)]
        return Plan(
            lines[0], [Divider(line) for line in lines[1:]], edge_length=h * unit, tension=5.0
        ).surface()

    one, other = built(1.0, 0.0), built(unit, shift)
    np.testing.assert_array_equal(other.faces, one.faces)
    moved = one.vertices[:, :2] * unit + shift
    np.testing.assert_allclose(other.vertices[:, :2], moved, rtol=0, atol=1e-8 * unit)
