"""What several test files start from."""

import os
import signal

import pytest

from generators import spherical_cap
from pcmc import solve


def pytest_sessionstart():
    """Answer Ctrl-C as Python does, also where the parent ignores it, as for jobs in the background.

    Some tests raise SIGINT, and a process that they start inherits whether it is ignored.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ["PCMC_CACHE"] = "off"  # no test takes a roof that another run has solved


@pytest.fixture(scope="session")
def small_cap():
    """A stable cap of few triangles, at rest under tension 0.6."""
    return solve(spherical_cap(0.25)).surface
