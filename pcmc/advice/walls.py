"""What to type where finer meshes do not hold a roof: walls that stay upright, or stronger ones.

Near its end on a straight outline a junction lies down along one of its sheets, unless its wall holds it in
a plane or down on its bottom: weak walls have shapes on coarse meshes that no smooth surface has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..plan import Plan
from ..surface import Surface
from ..surface.pieces import two_digits
from .advice import changes, coarse, straight_walls, with_dividers

STRONG = (1.0, 1.6)  # times the largest tension of the patches: such walls rest at their ends, or all along


def firmer_walls(plan: Plan, surface: Surface, where: str, persists: Callable[[Plan], bool]) -> list[str]:
    """What to type so that finer meshes hold the roof, too: a heading, and a line a change.

    Empty if nothing helps of what is tried. ``surface`` is the roof at rest, ``where`` such as
    "type in roof.toml", and ``persists`` says whether the roof of another plan comes to rest, as on finer
    meshes.
    """
    for other in _firmer(plan, surface):
        if persists(coarse(other, surface)):
            return [f"{where}, which was tried and persists:", *changes(plan, other)]
    return []


def _firmer(plan: Plan, surface: Surface) -> Iterator[Plan]:
    most, straight = float(surface.tensions[surface.roof].max()), straight_walls(plan)
    walls = {divider.name: divider for divider in plan.dividers if divider.wall is not None}
    if any(not walls[name].upright for name in straight):
        yield with_dividers(plan, straight, upright=True)
    for times in STRONG if walls else ():
        yield with_dividers(plan, set(walls), wall=two_digits(times * most))
