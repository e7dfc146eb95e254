"""What several tests of drawings start from."""

from __future__ import annotations

import pytest

import pcmc
from generators import two_squares
from pcmc.drawings import drawing_set


@pytest.fixture(scope="session")
def squares():
    """Example 1 at rest."""
    return pcmc.solve(two_squares(6, alpha_aux=1.0)).surface


@pytest.fixture(scope="session")
def drawings(squares):
    return drawing_set(squares, "m", sheet="A3", tolerance=0.01, name="two squares")
