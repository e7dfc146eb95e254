"""Plans: what they become, their angles, and every way in which a plan can be wrong."""

import builtins
import sys
import tomllib

import numpy as np
import pytest

from pcmc import Plane, Surface, Verdict, certify, solve
from pcmc.energy import patch_areas
from pcmc.errors import MissingExtra, OptionError, PlanError, SurfaceError
from pcmc.plan import Area, Divider, Hole, Plan, add_walls, plan_from
from pcmc.plan.curves import arc, bezier, circle, curve, join, polyline, to_local
from pcmc.plan.lift import dome, spanned
from pcmc.plan.planar import triangulate
from pcmc.quality import edge_lengths, minimum_angle
from pcmc.topology import POINT

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


def test_the_same_plan_gives_the_same_surface():
    one, two = (plan_from(tomllib.loads(L_WITH_COURTYARD)).surface() for _ in range(2))
    np.testing.assert_array_equal(one.vertices, two.vertices)
    np.testing.assert_array_equal(one.faces, two.faces)


def test_arcs_and_circles_keep_their_radius():
    half = join(polyline([[10, 0], [-10, 0]]), arc([-10, 0], [0, -10], [10, 0]))
    surface = Plan(half, [[[0, 0], [0, -10]]], tension=10.0).surface()
    X = surface.vertices[surface.fixed]
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
    surface = Plan(high, [[[10, 0], [10, 12]]], tension=10.0, edge_length=1.5).surface()
    wall = vertices_of(surface, "wall 1")
    X = surface.vertices
    end = wall[np.abs(X[wall, 1]) < 1e-9]
    assert surface.fixed[end].all()
    np.testing.assert_allclose([X[end, 2].min(), X[end, 2].max()], [0.0, 2.5])
    foot = wall[(np.abs(X[wall, 2]) < 1e-12) & ~surface.fixed[wall]]
    assert surface.on_plane[foot].all()
    assert len(foot) == 7


def test_what_is_drawn_across_a_hole_or_beyond_the_outline_is_left_out():
    cross = [[[10, -1], [10, 13]], [[-1, 6], [21, 6]]]
    surface = Plan(BOX, cross, [circle([10, 6], 2)], tension=10.0).surface()
    assert names(surface)[-2:] == ["wall 1", "wall 2"]
    assert len(surface.patches) == 6
    inside = np.linalg.norm(surface.vertices[:, :2] - [10, 6], axis=1)
    assert inside.min() > 2.0 - 1e-12


def test_a_free_hole_rises_and_its_walls_end_free():
    surface = Plan(
        BOX, [[[10, 0], [10, 12]]], [Hole(circle([10, 6], 2), "free")], tension=10.0
    ).surface()
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
    assert surface.on_plane.sum() == 31
    assert minimum_angle(surface) > 24.0


def test_dividers_that_cross_share_a_line():
    surface = Plan(BOX, [[[10, 0], [10, 12]], [[0, 6], [20, 6]]], tension=10.0).surface()
    line = [c for c in surface.topology.junctions if set(c.sheets) == {4, 5}]
    assert len(line) == 1
    assert line[0].sheets == (4, 4, 5, 5)


def test_points_curves_and_edges_as_supports():
    beam = bezier([[5, 8, 1], [10, 10, 4], [15, 8, 1]])
    surface = Plan(
        BOX, edge="free", tension=10.0,
        supports=[[[0, 0], [6, 0]], [[20, 6], [20, 12], [14, 12]], [0, 12], [10, 4, 2.0], beam],
    ).surface()  # fmt: skip
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


def test_a_sliding_outline():
    surface = Plan(BOX, edge="sliding", supports=[[0, 0]], tension=10.0).surface()
    assert surface.fixed.sum() == 1
    assert surface.on_plane.sum() == 63


def test_seams_without_walls_and_one_patch_in_two_parts():
    dividers = [Divider([[x, 0], [x, 12]], wall=None) for x in (7, 14)]
    patches = [Area("ends", 3.0, at=[[1, 1], [19, 1]]), Area("middle", 4.0, 0.5, at=[10, 6])]
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
    base = spanned(mesh.points, mesh.triangles, heights)
    np.testing.assert_allclose(base, mesh.points[:, 0] * 2 + 1, atol=1e-12)


@pytest.mark.slow
def test_twenty_thousand_triangles():
    surface = plan_from({**tomllib.loads(L_WITH_COURTYARD), "edge_length": 0.2}).surface()
    assert surface.m > 20_000
    assert minimum_angle(surface) > 20.0


COURT = {"curve": circle([17, 5], 2)}
WALL = [[10, 0], [10, 12]]
WEST, EAST = 3.85 * np.array([[-np.cos(0.4), -np.sin(0.4)], [np.cos(0.4), np.sin(0.4)]])
TURNED = join(arc(WEST, [0, 3.85], EAST), arc(EAST, [0, -3.85], WEST))  # octagons would cross


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"outline": [[0, 0], [4, 4], [4, 0], [0, 4]]}, r"the outline crosses itself at \(2, 2\)"),
        ({"outline": polyline(BOX)}, r"the outline is open: .* 12 apart"),
        ({"outline": [[0, 0, 0], [9, 0, 0], [4, 0, 4]]}, "the outline crosses itself"),
        ({"holes": [polyline([[1, 1], [2, 1], [2, 2]])]}, "hole 1 is open"),
        ({"holes": [circle([30, 5], 2)]}, "hole 1 lies outside the outline"),
        ({"holes": [{**COURT, "name": "court"}, circle([19, 5], 2)]}, "hole 2 crosses or touches"),
        ({"holes": [circle([6, 5], 2), circle([8, 5], 1)]}, "hole 1 and hole 2 touch or overlap"),
        ({"dividers": [[[10, 0], [10, 9]]]}, r"'wall 1' ends at \(10, 9\) .* nearest, 3 away"),
        ({"dividers": [[[25, 0], [25, 9]]]}, "divider 'wall 1' lies outside the plan"),
        ({"dividers": [WALL, [[0, 6], [9, 6]]]}, "divider 'wall 1' is nearest, 1 away"),
        ({"dividers": [[[0, 0], [20, 0]]]}, "divider 'wall 1' runs along the outline"),
        ({"dividers": [[[1, 0.004], [9, 0]]]}, "'wall 1' runs along the outline near"),
        ({"supports": [[25, 3]]}, r"the support at \(25, 3\) lies outside the plan"),
        ({"supports": [[17, 5]], "holes": [COURT]}, r"the support at \(17, 5\) lies outside"),
        ({"dividers": [[[2, 0], [8, 12], [8, 0], [2, 12]]]}, "'wall 1' crosses itself at"),
        ({"dividers": [[[5, 5, 0], [5, 5, 3]]]}, "'wall 1' has no length on the plane"),
        ({"dividers": [WALL], "patches": {"a": {"tension": 1}}}, "into 2 parts, but 1 patches"),
        ({"dividers": [WALL], "patches": {"a": {"tension": 1, "at": [1, 1]}}}, "has no patch"),
        (
            {"patches": {"a": {"tension": 1, "at": [1, 1]}, "b": {"tension": 1, "at": [9, 1]}}},
            "patches 'a' and 'b' are at the same part",
        ),
        ({"patches": {"a": {"tension": 1, "at": [1, 99]}}}, r"'a': its point \[1.0, 99.0\]"),
        (
            {"patches": {"a": {"tension": 1, "at": [1, 1]}, "b": {"tension": 1}}},
            "patch 'b' has no at=",
        ),
        ({"edge": "free"}, "nothing holds the roof"),
        (
            {
                "outline": [[0, 0, 1], [20, 0, 2], [20, 12, 1], [0, 12, 1]],
                "dividers": [{"curve": WALL, "bottom": "sloped"}, [[0, 6], [10, 6]]],
            },
            "a wall with a sloped bottom meets one",
        ),
        (
            {"outline": circle([0, 0], 4), "holes": [TURNED], "edge_length": 3.5},
            "the outline and hole 1 cross near .* smaller edge_length",
        ),
        ({"edge_length": 20.0}, "every vertex .* smaller edge_length"),
        ({"rise": 1e6}, r"rise=1e\+06 is more than 10 times the plan's size, 23.32"),
        ({"holes": [circle([17, 5], 1e-9)]}, "hole 1 is only .*e-09 wide, too little for edges"),
        ({"edge_length": 30.0}, "edge_length=30 is longer than the plan, 23.32 from corner"),
        ({"edge_length": 1e-4}, "about 5.5e\\+10 triangles"),
    ],
)  # fmt: skip
def test_wrong_plans_are_refused(changes, message):
    with pytest.raises(PlanError, match=message):
        plan_from({"outline": BOX, "tension": 5.0, "edge_length": 1.0, **changes}).surface()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"outlin": BOX}, "unknown plan key 'outlin'; did you mean 'outline'"),
        ({"edge_length": 0.0}, "edge_length must be a finite number > 0"),
        ({"edge_length": "1"}, "edge_length must be a finite number > 0"),
        ({"rise": -1.0}, "rise must be"),
        ({"edge": "hinged"}, "outline: edge: unknown value 'hinged'"),
        ({"edge_length": True}, "edge_length must be a finite number > 0, found True"),
        ({"supports": [[np.nan, 2.0]]}, r"support 1: the point \[nan, 2.0\] is not finite"),
        ({"tension": None}, "needs patches with tensions"),
        ({"plane": {"normals": [0, 0, 1]}}, "did you mean 'normal'"),
        ({"dividers": [{"curve": WALL, "botom": "held"}]}, "divider 1 key 'botom'; did you mean"),
        (
            {"dividers": [{"curve": WALL, "bottom": "hold"}]},
            "divider 1: bottom: unknown value 'hold'; did you",
        ),
        ({"dividers": [[[0, 0]]]}, "divider 1: polyline: expected 2 points"),
        ({"holes": [{**COURT, "edge": "fix"}]}, "hole 1: edge: unknown value 'fix'; did you mean"),
        ({"holes": [5]}, "hole 1: polyline: expected points"),
        ({"supports": [[[0, 0], [np.inf, 0]]]}, "support 1: .* is not finite"),
        ({"patches": {"a": {"tensions": 1.0}}}, "patch 'a' key 'tensions'; did you mean 'tension'"),
        ({"patches": {"a": {"at": [1, 1]}}}, "patch 'a' needs a tension"),
        ({"patches": {"a": 3.0}}, "patch 'a' key: expected a table"),
        ({"patches": [Area("a", 1.0), Area("a", 1.0)]}, "the name 'a' is used twice"),
    ],
)
def test_wrong_values_are_refused_at_once(changes, message):
    with pytest.raises(OptionError, match=message):
        plan_from({"outline": BOX, "tension": 5.0, **changes})


def test_a_plan_needs_an_outline():
    with pytest.raises(OptionError, match="needs an outline"):
        plan_from({"tension": 1.0})


def test_a_short_divider_between_edges_still_gets_a_wall():
    surface = Plan(BOX, [[[19, 0], [20, 1]]], tension=5.0, edge_length=2.0).surface()
    assert len(vertices_of(surface, "wall 1")) == 4


def test_walls_need_room_above_the_plane():
    low = [[0, 0, -2], [20, 0, -2], [20, 12, -2], [0, 12, -2]]
    with pytest.raises(SurfaceError, match="no room for a wall"):
        Plan(low, [WALL], tension=5.0).surface()


def test_without_shapely_the_extra_is_named(monkeypatch):
    plan = Plan(curve(BOX, closed=True), tension=5.0)
    real = builtins.__import__

    def without(name, *rest, **more):
        if name == "shapely":
            raise ModuleNotFoundError(name, name=name)
        return real(name, *rest, **more)

    for module in ("pcmc.plan.lines", "pcmc.plan.arrangement", "pcmc.plan.drafting"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtra, match=r"pcmc\[plan\]"):
        plan.surface()


def two_rooms(at=(0.0, 0.0), pressures=(1.0, 0.8)):
    x, y = at
    return Plan(
        [[x, y], [x + 12, y], [x + 12, y + 8], [x, y + 8]],
        [Divider([[x + 6, y], [x + 6, y + 8]], 1.0, bottom="held")],
        edge_length=1.5,
        patches=[Area("west", 6.0, pressures[0]), Area("east", 6.0, pressures[1])],
    )


def test_a_wall_between_rooms_of_different_pressures_carries_the_difference():
    wall = two_rooms().surface().patches[-1]
    assert (wall.name, wall.auxiliary) == ("wall 1", True)
    assert wall.pressure == pytest.approx(0.2)
    assert two_rooms(pressures=(0.8, 1.0)).surface().patches[-1].pressure == pytest.approx(-0.2)
    assert two_rooms(pressures=(1.0, 1.0)).surface().patches[-1].pressure == 0.0


def test_the_difference_pushes_the_wall_from_the_fuller_room():
    surface = two_rooms().surface()
    result = solve(surface)
    assert result.certificate.verdict is Verdict.STABLE
    wall = vertices_of(surface, "wall 1")
    assert result.surface.vertices[wall, 0].mean() > surface.vertices[wall, 0].mean()


def test_two_pressures_give_one_roof_whatever_the_point_of_the_plane():
    here = two_rooms().surface()
    there = Surface(
        here.vertices, here.faces, here.patch_of_face, here.patches, fixed=here.fixed,
        on_plane=here.on_plane, plane=Plane((40.0, -30.0, 0.0)),
    )  # fmt: skip
    one, two = solve(here), solve(there)
    assert two.energy == pytest.approx(one.energy, rel=1e-12)
    assert two.certificate.volume == pytest.approx(one.certificate.volume, rel=1e-12)
    np.testing.assert_allclose(two.surface.vertices, one.surface.vertices, atol=1e-9)
    found = one.certificate
    assert "point of Π" not in found.detail
    assert found.load == pytest.approx(1.0 * 48 + 0.8 * 48, rel=1e-12)
    # what a mesh leaves along its sheets is of second order in the edge length
    assert found.reactions.sum(axis=0) == pytest.approx([0, 0, -found.load], abs=3e-3 * 86.4)
    assert found.support == pytest.approx(found.reactions[:, 2].sum())


def test_a_divider_past_three_rooms_has_a_wall_for_each_difference():
    plan = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]],
        [Divider([[6, 0], [6, 8]], 2.0, name="spine"), Divider([[6, 4], [12, 4]], 2.0)],
        edge_length=1.0,
        patches=[
            Area("west", 6.0, 1.0, at=[3, 4]),
            Area("south", 6.0, 0.9, at=[9, 2]),
            Area("north", 6.0, 0.8, at=[9, 6]),
        ],
    )
    walls = {p.name: p.pressure for p in plan.surface().patches if p.wall}
    assert list(walls) == ["spine-1", "spine-2", "wall 2"]
    assert sorted(map(abs, walls.values())) == pytest.approx([0.1, 0.1, 0.2])


def test_walls_put_under_a_mesh_carry_the_difference_too():
    bare = Plan(
        [[0, 0], [12, 0], [12, 8], [0, 8]], [Divider([[6, 0], [6, 8]], wall=None)], edge_length=1.5,
        patches=[Area("west", 6.0, 1.0), Area("east", 6.0, 0.8)],
    ).surface()  # fmt: skip
    found = certify(bare)
    assert "the pressures leave 0.2 over" in found.detail
    wall = add_walls(bare).patches[-1]
    assert wall.pressure == pytest.approx(0.2)
    assert "point of Π" not in certify(add_walls(bare)).detail
