"""Films that vanish: their neighbours swapped, solved and certified; undone where nothing comes to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ..base import validate
from ..base.errors import SurfaceError
from ..certificate.diagnosis import vanished_films
from ..forces.rooms import energy_at_volumes
from ..meshing.neighbour_swap import swap
from ..surface import Surface, expect_surface
from ..surface.parts import listed
from . import solve
from .result import Result


@dataclass(frozen=True, eq=False)
class NeighbourSwap:
    """What became of a swap. ``print`` shows the message.

    Attributes
    ----------
    surface : the surface at rest after the swap; where that was undone, the given one.
    kept : whether it came to rest.
    message : a sentence: which patches meet, and the energies; or why the swap was undone.
    result : the end of the solve after the swap, with its certificate.
    """

    surface: Surface = field(repr=False)
    kept: bool
    message: str
    result: Result = field(repr=False)

    def __str__(self) -> str:
        return self.message


def swap_neighbours(
    surface: Surface, patches: str | Sequence[str] | None = None, **options: Any
) -> NeighbourSwap:
    """Replace films between two junctions by films between the other patches there, and solve.

    This is the T1 change of a foam. A film F meets the patches A and B at the one junction, C and D at the
    other, with A and C on the same side. F shrinks to nothing and opens the other way: then A and C meet,
    and B and D. Below a roof the same happens to a wall: the two rooms at its ends become neighbours. The new
    film has the name, tension and weight of the old one; its pressure follows from those beside it. If its
    tension is too large for it to open, the four meet directly and the patch is gone.

    Parameters
    ----------
    surface : best one that was solved until the film vanished, ``result.surface``.
    patches : the films; by default those that have vanished.
    options : of the geometric solver, as for ``pcmc.solve``.

    Raises
    ------
    SurfaceError : no film has vanished; a patch is no film between two junctions with four different patches
        around; its junctions are held at different places, or a cable runs on it.

    Examples
    --------
    Five films between two plates and four lines, at the corners of a rectangle of 0.5 by 1. The middle one
    along the short side vanishes; along the long side it is at rest with E = 1 + 0.5 √3 (Steiner's tree).

    >>> import numpy as np
    >>> import pcmc
    >>> corners = [[-0.25, -0.5], [-0.25, 0.5], [0.25, -0.5], [0.25, 0.5], [-0.1, 0.0], [0.1, 0.0]]
    >>> X = [[x, y, z] for z in (0.0, 0.25, 0.5, 0.75, 1.0) for x, y in corners]
    >>> ways = np.concatenate([np.array([(0, 4), (1, 4), (2, 5), (3, 5), (4, 5)]) + 6 * k for k in range(4)])
    >>> faces = [face for a, b in ways for face in ([a, b, b + 6], [a, b + 6, a + 6])]
    >>> films = pcmc.Surface(X, faces, np.tile(np.repeat(np.arange(5), 2), 4),
    ...                      [pcmc.Patch(name, 1.0, 0.0) for name in ("SW", "NW", "SE", "NE", "middle")],
    ...                      fixed=np.arange(30) % 6 < 4, images=pcmc.images_in(X, [[0, 0, 1]]))
    >>> swapped = swap_neighbours(pcmc.solve(films).surface)
    >>> print(swapped)  # doctest: +ELLIPSIS
    'SW' and 'SE' now meet, and 'NW' and 'NE'; E = 1.866025, 2.236... before
    """
    expect_surface(surface)
    if not isinstance(patches, str | Sequence | None):
        validate.refuse("patches", patches, "the name of a film, or a list of names")
    names = [patches] if isinstance(patches, str) else patches or vanished_films(surface)
    if not names:
        known = listed([patch.name for patch in surface.patches])
        text = f"no film between two junctions has vanished; name the one to swap: patches=..., of {known}"
        raise SurfaceError(text, what="patches")
    changed, sentences = surface, []
    for name in names:
        changed, what = swap(changed, name)
        sentences.append(what)
    result = solve(changed, **options)
    if result.converged:
        now, then = energy_at_volumes(result.surface), energy_at_volumes(surface)
        sentences.append(f"E = {now:.7g}, {then:.7g} before")
        return NeighbourSwap(result.surface, True, "; ".join(dict.fromkeys(sentences)), result)
    again = [name for name in vanished_films(result.surface) if name in names]
    why = f"patch {again[0]!r} vanishes again" if again else result.message
    return NeighbourSwap(surface, False, f"undone, as nothing comes to rest after the swap: {why}", result)
