"""The sparse solvers that tests run with: the one that is taken by default, and the others by night."""

import pytest

from pcmc.stability.factorisation import installed

DEFAULT, *OTHERS = installed()
BACKENDS = [DEFAULT, *(pytest.param(name, marks=pytest.mark.nightly) for name in OTHERS)]
every_backend = pytest.mark.parametrize("backend", BACKENDS)
