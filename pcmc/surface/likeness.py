"""Whether the two sides of a plane are alike, so that one of them stands for both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..base.arrays import Ints
from ..base.errors import SurfaceError
from ..base.tolerances import ON
from .geometry import segment_lengths
from .guides import Plane
from .pieces import point_text

if TYPE_CHECKING:
    from .surface import Surface


def refuse_unlike(surface: Surface, plane: Plane, side: Ints) -> None:
    """Refuse (SurfaceError) a surface whose sides of a plane differ in their patches, cables or fixed places.

    ``side`` (n,) is 1 in front of the plane, -1 behind it, 0 in it. The triangles may differ: a fixed vertex
    may be half an edge of the held curves away from the image of one. A piece between other mirror planes is
    not looked at, as its images go on behind these.
    """
    if any(other.mirror for other, _ in surface.on_planes):
        return
    parts: list[tuple[str, tuple[float, ...], Ints]] = []
    for k, p in enumerate(surface.patches):  # the pressure of a room is a result, and differs with the mesh
        loads = abs(p.pressure) * (not surface.room_signs[:, k].any()), p.weight, abs(p.snow)
        parts.append((f"patch {p.name!r}", (p.tension, *loads), surface.faces[surface.patch_of_face == k]))
    parts += [(f"cable {c.name!r}", (c.tension, c.weight), c.edges) for c in surface.cables]
    digits = [" ".join(f"{number:.5g}" for number in numbers) for _, numbers, _ in parts]  # met, or given
    for sign in (1, -1):
        behind = {kind for kind, (_, _, on) in zip(digits, parts, strict=True) if (sign * side[on] < 0).any()}
        for kind, (name, _, on) in zip(digits, parts, strict=True):
            if (sign * side[on] > 0).any() and kind not in behind:
                text = f"the {plane} divides no symmetric surface: nothing on its other side has the tension"
                raise SurfaceError(f"{text} and the loads of {name}", what="plane", where=name)
    from scipy.spatial import cKDTree  # here, as few surfaces are cut

    X, fixed, edges = surface.vertices, surface.given_supports.fixed, surface.topology.edges
    held = edges[fixed[edges].all(axis=1)]
    reach = 0.5 * segment_lengths(X, held).max(initial=0.0) + 10.0 * ON * surface.size
    for sign in (1, -1):
        here, there = X[fixed & (sign * side > 0)], X[fixed & (sign * side <= 0)]
        image = here - 2.0 * plane.height(here)[:, None] * np.array(plane.normal)
        away = np.asarray(cKDTree(there).query(image)[0]) if len(there) else np.full(len(here), np.inf)
        if len(here) and away.max() > reach:
            text = f"the {plane} divides no symmetric surface: the fixed vertex at"
            at, place = (point_text(places[away.argmax()], surface.size) for places in (here, image))
            raise SurfaceError(f"{text} {at} has no image at {place}", what="plane", where=at)
