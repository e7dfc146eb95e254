"""Surfaces with several kinds of supports."""

from pcmc import Plane, cut
from pcmc.plan import CableLine, Divider, Plan


def half_with_mirror():
    """Half a hall whose wall leans, cut at a mirror plane, under snow."""
    whole = Plan([[0, 0], [9, 0], [9, 4], [0, 4]], [Divider([[4, 0], [4, 4]])], edge_length=0.7, tension=4.0)
    return cut(whole.surface().with_snow(0.3), Plane((0, 2, 0), (0, 1, 0), "middle", mirror=True))


def cables_between_walls():
    """Three raised sides are held, a cable along the fourth ends on them; inside, a mast and a line."""
    inside = [[4, 3, 1.5], [[2, 2, 0.8], [2, 4, 0.8]]]
    sides = [[8, 0, 1], [8, 6, 0], [0, 6, 1], [0, 0, 0.5]]
    sail = {"roof": {"tension": 4.0, "pressure": 0.0, "weight": 0.2}}
    outline = [*sides[3:], *sides[:3]]
    free = [CableLine([[0, 0], [8, 0]], 30.0)]
    return Plan(outline, edge_length=1.0, patches=sail, supports=inside, cables=free).surface()
