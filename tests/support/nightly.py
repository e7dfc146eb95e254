"""Which cases of a test run only at night: repeated sizes, kinds and seeds; see the mark ``nightly``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def at_night(*cases: Any) -> list[Any]:
    """These cases of a parameter, or of several, which are tuples, at night only."""
    together = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*case, marks=pytest.mark.nightly) for case in together]


def night_but(cases: Iterable[Any], *kept: Any) -> list[Any]:
    """All cases of a parameter, those that are not ``kept`` at night only."""
    return [case if case in kept else at_night(case)[0] for case in cases]
