"""The tension of a wall that balances its neighbours with room to spare."""

from __future__ import annotations

import math
from collections.abc import Sequence

ROOM = 0.3  # of the smaller tension: the wall's tension above the difference of its neighbours'


def balanced_wall(neighbours: Sequence[Sequence[float]], most: float = math.inf) -> float:
    """A tension for a wall: the difference of its neighbours' tensions and 0.3 of the smallest one.

    A junction balances where the wall's tension is between the difference and the sum of the others'. Two
    digits, or more where two would leave too little of that room.

    Parameters
    ----------
    neighbours : for each part of the wall the tensions of the patches beside it, force/length; the part that
        needs most counts, as far as all of them balance.
    most : the most by which the wall may exceed the difference, force/length.

    >>> balanced_wall([(5.0, 4.0)]), balanced_wall([(100.0, 1.0)]), balanced_wall([(3.0,)])
    (2.2, 99.3, 0.9)
    """
    parts = [tensions for tensions in neighbours if tensions]
    if not parts:
        return 0.0
    low = max(max(t) - min(t) for t in parts)
    high = min(sum(t) if len(t) > 1 else math.inf for t in parts)
    wanted = max(max(t) - min(t) + min(ROOM * min(t), most) for t in parts)
    if low < high < math.inf:
        wanted = min(wanted, 0.5 * (low + high))
    room = wanted - low
    rounded = (float(f"{wanted:.{digits}g}") for digits in range(2, 17))
    return next((value for value in rounded if abs(value - wanted) <= 0.2 * room), wanted)
