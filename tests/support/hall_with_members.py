"""Two bays with a member in the place of the wall between them."""

from functools import cache

import pcmc
from pcmc import Material, SelfWeight, Snow, StructuralModel
from pcmc.plan import Plan
from pcmc.structure import Member, Profile, analyse

STEEL = Material(2.1e8, density=7.85)
TUBE = Profile.tube(0.1, 0.005)


@cache
def hall(scale=1.0, east=0.3, wall=0.6):
    """Two bays with a wall between them, at rest; all forces times a scale."""
    bays = {"west": (1.5, 0.3), "east": (1.5, east)}
    bays = {name: {"tension": a * scale, "pressure": p * scale} for name, (a, p) in bays.items()}
    line = {"curve": [[6, 0], [6, 8]], "wall": wall * scale}
    return pcmc.solve(
        Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [line], edge_length=1.2, patches=bays).surface()
    )


def hall_with(member=None, of=None, **more):
    member = member or Member("wall 1", TUBE, STEEL)
    return StructuralModel(of or hall(), Material(5e5, 0.2, 1.2), 0.001, members=[member], **more)


@cache
def hall_under_load():
    """The hall with an arch, by CalculiX."""
    return analyse(hall_with(loads=[SelfWeight(), Snow(0.1)]), remedy=False)
