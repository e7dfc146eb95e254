"""What the layers of a drawing mean."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

MEANINGS = {
    "outline": "the closed edge of the roof",
    "divider NAME": "a line between patches; a wall stands below it",
    "hole NAME": "a closed edge of an opening, held at its height",
    "upright NAME": "a straight divider whose wall stands upright",
    "cable NAME": "a cable along a free edge, or across the roof",
    "free": "a part of an edge that nothing holds; it gets a cable",
    "mirror": "straight edges at which the roof goes on as its mirror image",
    "support": "points and curves that hold the roof where they are drawn",
    "mast NAME": "a point or a vertical line whose top holds the roof, or a closed ring",
    "height": "points through which the roof should pass, or texts such as 4.5",
    "patch NAME": "a point or a text inside a part of the plan: its name, or its name = its tension",
}
"""The layers that a drawing of a plan may have."""

ROLES = tuple(key.split()[0] for key in MEANINGS)
_NAME = re.compile(rf"({'|'.join(ROLES)})(?:e?s|\d+)?(?:[\s_:.=-]+(.*))?", re.I | re.S)


@dataclass(frozen=True)
class Layer:
    """A layer's role, one of ``ROLES``, and the name that follows it, or ""."""

    role: str
    name: str = ""


def layer_of(name: str) -> Layer | None:
    """The role of a layer; None for one that means nothing here. Case does not count in the role.

    >>> layer_of("DIVIDER-north wall"), layer_of("Holes"), layer_of("furniture")
    (Layer(role='divider', name='north wall'), Layer(role='hole', name=''), None)
    """
    own = re.split(r"::|\||\$\d+\$", name)[-1].strip()  # of nested layers, or of one bound from outside
    match = _NAME.fullmatch(own)
    return None if match is None else Layer(match[1].lower(), (match[2] or "").strip())


def understood() -> str:
    """The layers that mean something, for messages."""
    return ", ".join(MEANINGS)


def left_out(layers: Mapping[str, int]) -> str:
    """A sentence on layers that mean nothing here, with the role that each may be a misspelling of."""
    parts = []
    for name, count in list(layers.items())[:12]:
        word = re.split(r"[\s_:.-]+", name.strip().lower())[0]
        near = get_close_matches(word, ROLES, n=1, cutoff=0.75)
        hint = f", did you mean {near[0]!r}?" if near else ""
        parts.append(f"{name!r} ({count} {'entity' if count == 1 else 'entities'}{hint})")
    more = f" and {len(layers) - 12} more" if len(layers) > 12 else ""
    return f"layers left out: {', '.join(parts)}{more}; understood are {understood()}"


def listed(labels: Sequence[str]) -> str:
    """The first labels of strokes, for messages."""
    more = f" and {len(labels) - 4} more" if len(labels) > 4 else ""
    return f"{', '.join(labels[:4])}{more}"
