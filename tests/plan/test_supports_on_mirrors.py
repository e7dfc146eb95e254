"""A support in a mirror plane is inside the whole roof: the half holds what the whole holds."""

import numpy as np
import pytest

import pcmc
from pcmc.base.errors import PlanError
from pcmc.certificate.balance import load_ratio
from pcmc.certificate.quantities import figures
from pcmc.plan import Plan
from pcmc.project.values import single_points

WHOLE = [[0, 0, 2], [10, 0, 2], [10, 10, 2], [0, 10, 2]]
HALF = [[0, 0, 2], [5, 0, 2], [5, 10, 2], [0, 10, 2]]
MIRROR = [[[5, 0], [5, 10]]]
VALUES = {"edge_length": 0.7, "tension": 2.0, "pressure": 0.1}


def held_inside(surface, side=5.0):
    """The fixed vertices within the outline, up to x = side."""
    X = surface.vertices[surface.fixed]
    inner = (X[:, :2] > 0.01).all(axis=1) & (X[:, 1] < 9.99) & (X[:, 0] < side + 0.01)
    return X[inner]


@pytest.mark.parametrize(
    "support",
    [
        pytest.param([5, 5], id="point on the plane"),
        pytest.param([5, 5, 3.5], id="point"),
        pytest.param([[5, 3, 3], [5, 7, 3.5]], id="curve along the mirror"),
        pytest.param([[5, 3], [5, 7]], id="curve on the plane"),
        pytest.param([[3, 5, 3], [5, 5, 3]], id="curve up to the mirror"),
        pytest.param([[5, 0, 2], [5, 4, 3]], id="curve from the rim"),
    ],
)
def test_the_half_holds_what_the_whole_holds(support):
    half = held_inside(Plan(HALF, supports=[support], mirrors=MIRROR, **VALUES).surface())
    ends = np.array([[*p, 0.0][:3] for p in np.atleast_2d(np.array(support, dtype=float)).tolist()])
    for end in ends[(ends[:, 1] > 0.0) & (ends[:, 1] < 10.0)]:
        assert np.linalg.norm(half - end, axis=1).min() < 1e-9
    assert (np.abs(half[:, 2] - ends[:, 2].mean()) <= np.ptp(ends[:, 2]) / 2.0 + 1e-9).all()


def test_a_mast_in_the_mirror_carries_the_whole_sail():
    ring = {"circle": {"centre": [5, 5, 3], "radius": 1.0}}
    masts = [[0, 0], [10, 0], [10, 10], [0, 10]]
    flat = {"edge": "cable", "cable": 9.0, "edge_length": 0.5, "tension": 1.0, "pressure": 0.0}
    whole = pcmc.solve(Plan(masts, supports=masts, holes=[ring], **flat).surface())
    arc = {"arc": [[5, 6, 3], [4, 5, 3], [5, 4, 3]]}
    outline = [{"polyline": [[0, 0], [5, 0], [5, 4]]}, {"arc": [[5, 4], [4, 5], [5, 6]]}]
    outline += [{"polyline": [[5, 6], [5, 10], [0, 10], [0, 0]]}]
    mirrors = [[[5, 0], [5, 4]], [[5, 6], [5, 10]]]
    half = Plan(outline, supports=[[0, 0], [0, 10], arc], mirrors=mirrors, **flat)
    result = pcmc.solve(half.surface())
    energy = pcmc.energy(pcmc.mirrored(result.surface))
    assert result.converged
    assert energy == pytest.approx(pcmc.energy(whole.surface), rel=1e-3)


def test_a_cable_along_a_mirror_is_refused():
    along = [{"curve": [[5, 0], [5, 10]], "tension": 2.0, "name": "ridge"}]
    with pytest.raises(
        PlanError, match="cable 'ridge' runs along mirror 1, which is inside the whole roof; draw"
    ):
        Plan(HALF, mirrors=MIRROR, cables=along, edge_length=0.7, tension=2.0, pressure=0.0).surface()


def test_a_mirror_plane_is_no_support_below_a_roof():
    """The cushion's lower sheet is lowest in the mirror plane, where nothing holds it."""
    half = pcmc.solve(Plan(HALF, mirrors=MIRROR, cushion=1.5, **VALUES).surface()).surface
    rises = [
        next(f.value for f in figures(roof, pcmc.certify(roof)) if f.quantity == "rise")
        for roof in (half, pcmc.mirrored(half))
    ]
    assert rises[0] == pytest.approx(rises[1], rel=1e-12)


def test_the_sheets_of_a_cushion_are_apart_where_two_mirror_planes_meet():
    quarter = {"mirrors": [*MIRROR, [[0, 5], [5, 5]]], **VALUES}
    corners = [[0, 0, 2], [5, 0, 2], [5, 5, 2], [0, 5, 2]]
    roof, cushion = (pcmc.solve(Plan(corners, cushion=c, **quarter).surface()).surface for c in (None, 1.0))
    middle = np.linalg.norm(cushion.vertices[:, :2] - 5.0, axis=1) < 1e-9
    assert cushion.vertices[middle, 2].max() == pytest.approx(roof.vertices[:, 2].max(), rel=1e-3)
    assert middle.sum() == 2


def test_masts_in_the_mirror_carry_and_can_be_moved():
    masts = [[0, 0, 0], [5, 0, 3], [5, 6, 4], [5, 10, 0], [0, 10, 2]]
    flat = {
        "edge": "cable",
        "cable": 14.0,
        "edge_length": 1.0,
        "tension": 1.0,
        "pressure": 0.0,
        "weight": 0.02,
    }
    half = Plan([p[:2] for p in HALF], supports=masts, mirrors=MIRROR, **flat).surface()
    assert load_ratio(half) == pytest.approx(load_ratio(pcmc.mirrored(half)), rel=1e-12)
    assert len(single_points(half)) == len(masts)
