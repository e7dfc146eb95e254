"""A room of prescribed volume: its pressure is then a result."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import SurfaceError
from ..base.validate import checked_name
from . import checks


@dataclass(frozen=True)
class Room:
    """A room whose volume is prescribed instead of its pressure.

    Parameters
    ----------
    name : unique in its surface; 1 to 100 printable characters, no blank at either end.
    patches : mapping from the names of the patches around the room to 1, where the patch's positive normal
        points out of the room, or -1, where it points into it.
    volume : the volume (length³) of the room at rest.

    The pressures of these patches are where a solver starts; it changes them by sign · δ with one δ for each
    room. So a wall between two rooms keeps the difference of their pressures.

    >>> Room("left", {"cap": 1, "wall": -1}, 2.0).patches
    (('cap', 1), ('wall', -1))
    """

    name: str
    patches: tuple[tuple[str, int], ...]
    volume: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", checked_name("Room.name", self.name, error=SurfaceError))
        pairs = tuple(self.patches.items() if isinstance(self.patches, Mapping) else self.patches)
        if not pairs or not all(len(pair) == 2 and pair[1] in (1, -1) for pair in pairs):
            expected = "a mapping from names of patches to 1 or -1"
            validate.refuse("patches", self.patches, expected, self.name, error=SurfaceError)
        object.__setattr__(self, "patches", tuple((str(name), int(sign)) for name, sign in pairs))
        volume = validate.number("volume", self.volume, where=self.name, error=SurfaceError)
        if not math.isfinite(volume) or volume == 0.0:
            validate.refuse("volume", volume, "a number other than 0", self.name, error=SurfaceError)
        object.__setattr__(self, "volume", volume)


def checked_rooms(given: Any, patches: Sequence[str]) -> tuple[Room, ...]:
    """Rooms of unique names around patches of these names, their volumes independent of each other."""
    parts = tuple(given) if isinstance(given, Iterable) else (None,)
    if not all(isinstance(part, Room) for part in parts):
        validate.refuse("rooms", given, "a sequence of Room", error=SurfaceError)
    checks.unique_names("rooms", [room.name for room in parts])
    signs = room_signs(parts, patches)
    for k in range(1, len(parts) + 1):
        if np.linalg.matrix_rank(signs[:k]) < k:
            name = parts[k - 1].name
            message = f"room {name!r}: its volume is prescribed already, by that of the rooms before it"
            raise SurfaceError(f"{message}; remove it", what="rooms", where=name)
    return parts


def room_signs(rooms: Sequence[Room], patches: Sequence[str]) -> Floats:
    """(r,k) 1 or -1 where a patch bounds a room, by the sense of its normal; 0 elsewhere."""
    signs = np.zeros((len(rooms), len(patches)))
    for row, room in zip(signs, rooms, strict=True):
        for name, sign in room.patches:
            row[patches.index(validate.choice(f"room {room.name!r}: patch", name, list(patches)))] = sign
    return signs
