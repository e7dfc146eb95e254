"""Marks for tests beside other programs; where CI is set, their absence fails before any test runs."""

import pytest

from pcmc.structure import calculix
from studies.reference import evolver

needs_evolver = pytest.mark.skipif(
    not evolver.available(), reason="Surface Evolver is not installed (Debian: apt install evolver-nox)"
)
NO_CCX = "CalculiX is not installed (Debian: apt install calculix-ccx)"
needs_ccx = pytest.mark.skipif(not calculix.available(), reason=NO_CCX)


def expect_ccx() -> None:
    """Skip the rest of a case where CalculiX is missing; where its other cases need none."""
    if not calculix.available():
        pytest.skip(NO_CCX)
