"""Cables, weights, snow, volumes and mirrors, from the lines of a plan."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from force_cases import HALL, MASTS, SAIL, SQUARE, cables
from refusals import refused
from volume_cases import cap_height

import pcmc
from pcmc import Verdict
from pcmc.base.errors import PlanError, PlanWarning
from pcmc.forces.rooms import room_volumes
from pcmc.plan import CableLine, Divider, Hole, PatchSpec, Plan

# ---- cables in a plan


def test_an_edge_between_masts_carries_a_cable_per_stretch():
    surface = Plan(SQUARE, **SAIL).surface()
    assert {name: tension for name, (tension, _) in cables(surface).items()} == dict.fromkeys(
        ["cable 1", "cable 2", "cable 3", "cable 4"], 9.0
    )
    assert sum(count for _, count in cables(surface).values()) == surface.topology.boundary_edge.sum()
    np.testing.assert_allclose(surface.vertices[surface.fixed], MASTS)
    south = np.unique(surface.cables[0].edges)
    np.testing.assert_allclose(surface.vertices[south, 2], 4.0 - 0.4 * surface.vertices[south, 0], atol=1e-12)


def test_the_stretch_over_the_first_point_of_the_outline_is_one_cable():
    plan = Plan(SQUARE, **(SAIL | {"supports": [[5, 0], [10, 5], [5, 10], [0, 5]]}))
    surface = plan.surface()
    assert len(surface.cables) == 4
    assert sum(count for _, count in cables(surface).values()) == surface.topology.boundary_edge.sum()
    for cable in surface.cables:
        ends = np.bincount(cable.edges.ravel())
        assert (ends == 1).sum() == 2
        assert surface.fixed[np.flatnonzero(ends == 1)].all()


@pytest.mark.parametrize("edge", ["cable", "free"])
def test_a_support_curve_holds_a_loose_edge_at_its_own_height_and_without_cable(edge):
    cable = {"cable": 20.0} if edge == "cable" else {}
    values = {"edge": edge, "tension": 1.0, "pressure": 0.0, **cable}
    wall, beam = [[0, 10, 5], [10, 10, 5]], [[0, 6, 3], [10, 6, 3]]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PlanWarning)
        surface = Plan(SQUARE, supports=[wall, beam, [0, 0, 2], [10, 0, 2]], **values).surface()
    X, held = surface.vertices, surface.fixed
    for y, height, count in ((10.0, 5.0, 11), (6.0, 3.0, 11), (0.0, 2.0, 2)):
        there = X[held & (np.abs(X[:, 1] - y) < 1e-9)]
        np.testing.assert_allclose(there[:, 2], height)
        assert len(there) == count
    assert held.sum() == 24
    slope = X[(X[:, 0] < 1e-9) & (X[:, 1] > 6.0)]
    np.testing.assert_allclose(slope[:, 2], 3.0 + 0.5 * (slope[:, 1] - 6.0))
    stretches = [10, 4, 4, 6, 6] if cable else []
    assert sorted(len(cable.edges) for cable in surface.cables) == sorted(stretches)
    with refused(PlanError, what="supports", found=5.0):
        Plan(SQUARE, supports=[wall], tension=1.0).surface()


def test_a_flat_sail_is_bounded_by_arcs_of_radius_tension_over_tension():
    """τ/α = 9, chord 10: sag 9 - √(81 - 25); order 2 in the edge length."""
    sags = []
    for h in (1.5, 0.75):
        flat = SAIL | {"supports": [p[:2] for p in MASTS], "edge_length": h}
        result = pcmc.solve(Plan(SQUARE, **flat).surface())
        assert result.certificate.verdict is Verdict.STABLE
        sags.append(pcmc.Target("sag", "cable 1"))
        sags[-1] = pcmc.design.targets.measure(result.surface, sags[-1]).value
    errors = np.abs(np.array(sags) - (9.0 - 56.0**0.5))
    assert errors[1] < 0.4 * errors[0]
    assert errors[1] < 0.02


def test_parts_of_the_outline_and_holes_have_cables_of_their_own():
    lines = [CableLine([[0, 0], [10, 0]], 12.0, "south")]
    plan = Plan(
        SQUARE,
        holes=[Hole([[4, 4], [6, 4], [6, 6], [4, 6]], edge="cable", cable=0.7)],
        cables=lines,
        tension=1.0,
        pressure=0.0,
    )
    surface = plan.surface()
    assert cables(surface).keys() == {"cable 1", "south"}
    assert cables(surface)["south"] == (12.0, 10)
    assert surface.cables[0].tension == 0.7
    assert len(surface.cables[0].edges) == len(np.unique(surface.cables[0].edges))  # closed
    assert surface.fixed.sum() == 31


def test_a_named_cable_cut_by_a_mast_is_numbered():
    plan = Plan(SQUARE, cables=[CableLine([[0, 0], [10, 0]], 12.0, "south")], supports=[[5, 0]], tension=1.0,
                pressure=0.0)  # fmt: skip
    assert list(cables(plan.surface())) == ["south-1", "south-2"]


def test_a_divider_without_wall_is_a_ridge_cable():
    plan = Plan(
        SQUARE,
        [Divider([[5, 0], [5, 10]], wall=None, name="ridge", cable=2.0)],
        patches={"roof": {"tension": 3.0, "at": [[2, 5], [8, 5]]}},
        edge_length=1.5,
    )
    surface = plan.surface()
    assert [patch.name for patch in surface.patches] == ["roof"]
    assert cables(surface).keys() == {"ridge"}
    plain = pcmc.solve(surface.retensioned(cables={"ridge": 0.0})).surface
    low = pcmc.solve(surface).surface
    ridge = np.unique(surface.cables[0].edges)
    assert low.vertices[ridge, 2].max() < 0.95 * plain.vertices[ridge, 2].max()


def test_a_free_edge_without_cable_still_warns_and_one_with_a_cable_does_not():
    with pytest.warns(PlanWarning, match='edge = "cable"'):
        Plan(SQUARE, edge="free", supports=MASTS, tension=1.0, pressure=0.0).surface()
    Plan(SQUARE, **SAIL).surface()  # warnings are errors


# ---- weight, snow, volumes


def test_weight_and_snow_are_those_of_the_patches():
    areas = [PatchSpec("west", 3.0, at=[1, 1], weight=0.1), PatchSpec("east", 3.0, at=[9, 1], snow=0.5)]
    surface = Plan(HALL, [[[5, 0], [5, 6]]], patches=areas, snow=0.25).surface()
    assert surface.weights.tolist() == [0.1, 0.0, 0.0]
    assert surface.pressures.tolist() == [1.0, 1.0, 0.0]  # of the air, also on the wall
    assert surface.snows.tolist() == [0.25, 0.5, -0.25]
    assert surface.net_pressures.tolist() == [0.75, 0.5, 0.25]
    assert surface.uncancelled.max() == 0.0
    snowy = Plan(HALL, tension=3.0, snow=0.25, edge_length=1.5).surface()
    bare = Plan(HALL, tension=3.0, edge_length=1.5).surface()
    assert snowy.patches == bare.with_snow(0.25).patches


def test_a_patch_with_a_negative_volume_hangs_below_the_plane():
    """The cap of height h over the unit disc has the pressure 4 α h / (1 + h²)."""
    plan = {"outline": {"circle": {"centre": [0, 0], "radius": 1.0}}, "edge_length": 0.2}
    for volume in (1.0, -1.0):
        result = pcmc.solve(Plan(**plan, patches={"cap": {"tension": 2.0, "volume": volume}}).surface())
        assert result.certify().certified
        heights, h = result.surface.vertices[:, 2], np.sign(volume) * cap_height(1.0)
        assert heights[np.abs(heights).argmax()] == pytest.approx(h, rel=0.03)
        assert result.surface.pressures[0] == pytest.approx(8.0 * h / (1.0 + h * h), rel=0.03)


def test_rooms_of_prescribed_volume_close_at_their_walls():
    plan = Plan(
        HALL,
        [Divider([[4, 0], [4, 6]])],
        patches={"west": {"tension": 3.0, "volume": 20.0}, "east": {"tension": 3.0, "volume": 40.0}},
    )
    surface = plan.surface()
    assert [room.patches for room in surface.rooms] == [
        (("west", 1), ("wall 1", 1)),
        (("east", 1), ("wall 1", -1)),
    ]
    result = pcmc.solve(surface)
    assert result.certificate.verdict is Verdict.STABLE
    np.testing.assert_allclose(room_volumes(result.surface), [20.0, 40.0], rtol=1e-10)
    west, east, wall = result.surface.pressures
    assert wall == pytest.approx(west - east, abs=1e-12)


def test_a_room_under_two_patches_has_no_wall_between_them():
    plan = Plan(
        HALL,
        [Divider([[4, 0], [4, 6]])],
        patches={"west": {"tension": 3.0}, "east": {"tension": 3.0}},
        rooms={"hall": {"patches": ["west", "east"], "volume": 50.0}},
    )
    (room,) = plan.surface().rooms
    assert room.patches == (("west", 1), ("east", 1))


def test_a_wall_is_cut_where_the_room_beside_it_changes():
    lines = [Divider([[0, 3], [10, 3]], name="long"), [[5, 3], [5, 6]]]
    plan = Plan(
        HALL,
        lines,
        patches=[
            PatchSpec("south", 3.0, at=[5, 1]),
            PatchSpec("nw", 3.0, at=[1, 5]),
            PatchSpec("ne", 3.0, at=[9, 5], volume=9.0),
        ],
    )
    surface = plan.surface()
    assert [p.name for p in surface.patches[3:]] == ["long-1", "long-2", "wall 2"]
    (room,) = surface.rooms
    assert dict(room.patches).keys() == {"ne", "long-2", "wall 2"}


# ---- mirrors


def test_half_and_quarter_of_a_roof_are_the_whole():
    half = Plan(
        [[0, 0], [5, 0], [5, 6], [0, 6]],
        [Divider([[0, 3], [5, 3]])],
        patches={"south": {"tension": 3.0}, "north": {"tension": 3.2}},
        mirrors=[[[5, 0], [5, 6]]],
    ).surface()
    on_mirror = half.vertices[:, 0] == 5.0
    assert not (half.pinned & on_mirror & (half.vertices[:, 2] > 0.0)).any()
    quarter = Plan(
        [[0, 0], [5, 0], [5, 5], [0, 5]], tension=4.0, mirrors=[[[5, 0], [5, 5]], [[0, 5], [5, 5]]]
    ).surface()
    for piece, images in ((half, 2), (quarter, 4)):
        part = pcmc.solve(piece, tolerance=1e-13)
        whole = pcmc.solve(pcmc.mirrored(piece), tolerance=1e-13)
        assert whole.surface.m == images * piece.m
        assert images * part.energy == pytest.approx(whole.energy, rel=1e-11)
        images_of_part = pcmc.mirrored(part.surface)
        assert pcmc.certify(images_of_part).residual < 1e-12
        # inexact inner steps leave the vertices a little to one side or the other along the surface
        assert np.abs(images_of_part.vertices - whole.surface.vertices).max() < 1e-6 * whole.surface.size
    plane, mask = quarter.on_planes[0]
    assert plane.mirror
    assert plane.name == "mirror 1"
    assert (mask == (np.abs(quarter.vertices[:, 0] - 5.0) < 1e-9)).all()


def test_half_of_a_sail_is_at_rest_as_the_whole():
    """On a diagonal through two masts; the whole has the images of the cables."""
    half = Plan(SQUARE[:3], mirrors=[[SQUARE[0], SQUARE[2]]], **(SAIL | {"supports": MASTS[:3]})).surface()
    assert cables(half).keys() == {"cable 1", "cable 2"}
    assert half.vertices[half.on_planes[0][1], 2].min() > 1.0  # not the height of the outline there, 0
    whole = pcmc.mirrored(pcmc.solve(half, tolerance=1e-12).surface)
    certificate = pcmc.certify(whole)
    assert certificate.verdict is Verdict.STABLE
    assert certificate.residual < 1e-10
    assert whole.fixed.sum() == 4
    assert sum(count for _, count in cables(whole).values()) == whole.topology.boundary_edge.sum()


def test_a_mirror_across_a_tilted_plane_stands_on_it():
    plane = pcmc.Plane((1, 2, 3), (1, 0, 2))
    piece = Plan(
        [[0, 0], [4, 0], [4, 3]], tension=2.0, mirrors=[[[4, 0], [4, 3]]], edge_length=0.7, plane=plane
    ).surface()
    ((mirror, mask),) = piece.on_planes
    assert mask.sum() >= 5
    assert abs(np.dot(mirror.normal, plane.normal)) < 1e-12
