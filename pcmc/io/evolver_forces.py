"""Cables, weights and snow in Surface Evolver datafiles.

A cable is a line ``tension`` of its edges, which also have its number as the attribute ``cable``. A weight
w is the attribute ``weight`` of faces, and one quantity for each w, ``self_weight_k``: their integral of w z.
Snow is the attribute ``snow`` of faces, which the reader adds to the net pressures of the bodies.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any
from urllib.parse import unquote

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.names import names_from_file
from ..surface import Cable, Surface
from .text import escaped

WRITTEN = "written by pcmc"


SPECIAL = "\\*"  # in names: the program joins lines at a backslash, and "/*" begins a comment


def names_in(header: str, kind: str) -> dict[str, str]:
    """The names that comments give to patches, rooms or cables, by number."""
    rows = re.findall(rf"^// {kind} (\d+) ([^\n]+)$", header, re.M)
    names = names_from_file(name for _, name in rows)[0]
    return {number: unquote(names[name]) if WRITTEN in header else names[name] for number, name in rows}


def names(surface: Surface) -> list[str]:
    """A comment for each cable's name."""
    return [f"// cable {k} {escaped(cable.name, SPECIAL)}" for k, cable in enumerate(surface.cables, 1)]


def definitions(surface: Surface, origin: Floats) -> str:
    """The attributes and quantities, coordinates seen from ``origin`` (3,)."""
    text = "DEFINE EDGE ATTRIBUTE cable INTEGER\n" if surface.cables else ""
    text += "DEFINE FACET ATTRIBUTE snow REAL\n" if surface.snows.any() else ""
    weights = _weights(surface)
    if not len(weights):
        return text
    text += "DEFINE FACET ATTRIBUTE weight REAL\n"
    height = "".join(f"({c!r})*{axis} + " for c, axis in zip(surface.plane.normal, "xyz", strict=True))
    height += f"({float(surface.plane.height(origin))!r})"
    for k, weight in enumerate(weights.tolist(), 1):
        text += f"QUANTITY self_weight_{k} ENERGY METHOD FACET_SCALAR_INTEGRAL\n"
        text += f"SCALAR_INTEGRAND: ({weight!r})*({height})\n"
    return text


def edge_tags(surface: Surface, tags: Any) -> Any:
    """The tags (e,) of edges with the tension and the number of the cable on them."""
    tags = tags.astype(object)
    for k, cable in enumerate(surface.cables, 1):
        tags[surface.topology.edge_numbers(cable.edges)] += f" tension {cable.tension!r} cable {k}"
    return tags


def patch_tags(surface: Surface, tags: Any) -> Any:
    """The tags (k,) of the faces of patches with their weight and its quantity, and their snow."""
    tags, weights = tags.astype(object), _weights(surface).tolist()
    for k, patch in enumerate(surface.patches):
        if patch.snow:
            tags[k] += f" snow {patch.snow!r}"
        if patch.weight:
            tags[k] += f" weight {patch.weight!r} self_weight_{1 + weights.index(patch.weight)}"
    return tags


def _weights(surface: Surface) -> Floats:
    return np.unique(surface.weights[surface.weights != 0.0])


def _by_number(item: tuple[tuple[str, float], list[int]]) -> tuple[int, float]:
    (which, tension), _ = item
    return int(which), tension


def cables(
    header: str, rows: Sequence[str], ends: Ints, number: Callable[[str, int], float]
) -> tuple[Cable, ...]:
    """The edges with a line tension as cables, those of one number and tension together.

    Parameters
    ----------
    header : the text before the vertices, with the names.
    rows : what follows the vertices of each edge.
    ends : (e,2) its vertices.
    number : the value of a word in a row.
    """
    known = names_in(header, "cable")
    found: dict[tuple[str, float], list[int]] = {}
    for k, rest in enumerate(rows):
        given = re.search(r"\b(?:tension|density)\s+(\S+)", rest, re.I)
        tension = number(given[1], k) if given else 0.0
        which = re.search(r"\bcable\s+\{?(\d+)", rest, re.I)
        if tension or (which and which[1] in known):
            found.setdefault((which[1] if which else "0", tension), []).append(k)
    once = len({which for which, _ in found}) == len(found)
    return tuple(
        Cable(known.get(which, f"cable {k}") if once else f"cable {k}", tension, ends[rows_])
        for k, ((which, tension), rows_) in enumerate(sorted(found.items(), key=_by_number), 1)
    )
