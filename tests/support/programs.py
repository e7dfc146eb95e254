"""Marks for tests beside other programs; where CI is set, their absence fails before any test runs."""

import pytest

from pcmc.structure import calculix
from studies.reference import evolver

needs_evolver = pytest.mark.skipif(
    not evolver.available(), reason="Surface Evolver is not installed (Debian: apt install evolver-nox)"
)
needs_ccx = pytest.mark.skipif(
    not calculix.available(), reason="CalculiX is not installed (Debian: apt install calculix-ccx)"
)
