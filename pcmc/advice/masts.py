"""Single points that hold a roof inside its plan, and the rings that can stand for them.

A membrane held at one point has a peak there that is as thin as its triangles: how high the forces are
depends on the mesh, and on some meshes it comes to rest, on others not. A ring carries it on any mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats
from ..curves.curves import Curve
from ..plan import Divider, Hole, Plan
from ..plan.lines import SNAP, Kind, Line

SHARES = (0.06, 0.12, 0.25)  # of the way from a point to the nearest line: the radii of rings that are tried


@dataclass(frozen=True, eq=False)
class Mast:
    """A point inside the plan that holds the roof.

    Attributes
    ----------
    number : its place among the plan's supports.
    point : (3,) in the coordinates of Π.
    room : distance in plan to the nearest line or other point that is held.
    """

    number: int
    point: Floats
    room: float

    @property
    def text(self) -> str:
        """The point as it is typed: [x, y, z]."""
        return f"[{', '.join(f'{value:.6g}' for value in self.point)}]"


def point_masts(plan: Plan) -> list[Mast]:
    """The supports of a plan that are points inside it and on no line.

    >>> square = [[0, 0], [8, 0], [8, 8], [0, 8]]
    >>> tent = Plan(square, edge_length=1, tension=1.0, pressure=0.0, supports=[[0, 0], [4, 3, 2]])
    >>> [(mast.text, mast.room) for mast in point_masts(tent)]
    [('[4, 3, 2]', 3.0)]
    """
    curves = [s for s in plan.supports if isinstance(s, Curve)]
    parts: Sequence[Hole | Divider] = (*plan.holes, *plan.dividers)
    curves += [plan.outline, *(part.curve for part in parts)]
    lines = [Line("line", Kind.SUPPORT, curve.local(plan.plane)) for curve in curves]
    numbers = [k for k, support in enumerate(plan.supports) if not isinstance(support, Curve)]
    if not numbers:
        return []
    spots = np.array([_on_plane(plan, plan.supports[k]) for k in numbers])
    room = np.min([line.nearest(spots[:, :2])[1] for line in lines], axis=0)
    inside = room > SNAP * plan.edge_length
    if len(spots) > 1:
        near, _ = cKDTree(spots[:, :2]).query(spots[:, :2], k=[2])
        room = np.minimum(room, np.ravel(near))
    found = zip(numbers, spots, room.tolist(), inside, strict=True)
    return [Mast(number, spot, space) for number, spot, space, free in found if free]


def _on_plane(plan: Plan, spot: Floats) -> Floats:
    """(3,) a support in the coordinates of Π."""
    return plan.plane.to_local(spot) if len(spot) == 3 else np.append(np.asarray(spot, dtype=float), 0.0)


def with_rings(plan: Plan, masts: Sequence[Mast], share: float) -> Plan:
    """The plan with a held ring around each point instead of the point."""
    left_out = {mast.number for mast in masts}
    supports = [s for k, s in enumerate(plan.supports) if k not in left_out]
    rings = [
        Hole(
            {"circle": {"centre": mast.point.tolist(), "radius": _radius(mast, share)}}, name=f"mast {number}"
        )
        for number, mast in enumerate(masts, 1)
    ]
    return replace(plan, supports=supports, holes=[*plan.holes, *rings])


def ring_lines(masts: Sequence[Mast], share: float, *, drawn: bool) -> list[str]:
    """What to type, or to draw, for these rings."""
    lines = []
    for number, mast in enumerate(masts, 1):
        radius = f"{_radius(mast, share):g}"
        x, y, z = (f"{value:.6g}" for value in mast.point)
        if drawn:
            lines.append(f"draw a circle of radius {radius} around ({x}, {y}) at height {z} on layer 'mast'")
            lines.append(f"delete the point or line at ({x}, {y}) there")
            continue
        curve = f"{{circle = {{centre = [{x}, {y}, {z}], radius = {radius}}}}}"
        lines += ["[[plan.holes]]", f'name = "mast {number}"', f"curve = {curve}"]
        lines.append(f"[plan] supports: remove {mast.text}")
    return lines


def mast_note(plan: Plan) -> str:
    """That a roof is held at single points, and what to do; empty if it is not."""
    masts = point_masts(plan)
    if not masts:
        return ""
    points = ", ".join(mast.text for mast in masts[:4])
    line = ring_lines(masts[:1], SHARES[1], drawn=False)[2]
    return (
        f"the roof is held at {'a single point' if len(masts) == 1 else 'single points'} inside, {points}:"
        " there it has a peak as thin as the triangles, which comes to rest on some meshes and not on others;"
        f" hold it on a ring, in [[plan.holes]], instead: {line}"
    )


def _radius(mast: Mast, share: float) -> float:
    return float(f"{share * mast.room:.2g}")
