"""Patches, cables and rooms with other values, given by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..base import validate

KINDS = {
    **{f"{field}s": ("patches", field) for field in ("tension", "pressure", "snow", "weight")},
    "cables": ("cables", "tension"),
    "volumes": ("rooms", "volume"),
}
"""The arguments of ``Surface.retensioned``: the parts of the surface that each changes, and their field."""


def all_values(surface: Any) -> dict[str, dict[str, float]]:
    """The values of a Surface by kind and name, as ``Surface.retensioned`` takes them."""
    return {
        kind: {part.name: getattr(part, field) for part in getattr(surface, parts)}
        for kind, (parts, field) in KINDS.items()
    }


def renewed(kind: str, parts: tuple[Any, ...], **values: Mapping[str, object] | None) -> tuple[Any, ...]:
    """The parts, each a ``kind``, with other values of their fields; OptionError for an unknown name.

    >>> from pcmc import Patch
    >>> renewed("patch", (Patch("roof", 1.0),), tension={"roof": 2.0}, pressure={"roof": 3.0})
    (Patch(name='roof', tension=2.0, pressure=3.0),)
    """
    changes: dict[str, dict[str, object]] = {part.name: {} for part in parts}
    for field, by_name in values.items():
        for name, value in (by_name or {}).items():
            changes[validate.choice(kind, name, list(changes))][field] = value
    return tuple(replace(part, **changes[part.name]) if changes[part.name] else part for part in parts)
