"""What several test files start from."""

import pytest

from generators import spherical_cap
from pcmc import solve


@pytest.fixture(scope="session")
def small_cap():
    """A stable cap of few triangles, at rest under tension 0.6."""
    return solve(spherical_cap(0.25)).surface
