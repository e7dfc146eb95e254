"""Case functions to try a sweep with."""

from __future__ import annotations


def ratio(over: float, under: float) -> dict[str, object]:
    """``over / under`` as ``"value"``, with a verdict; an under of 0 raises.

    >>> ratio(1, 2)
    {'verdict': 'below one', 'value': 0.5}
    """
    value = over / under
    return {"verdict": "below one" if value < 1 else "at least one", "value": value}
