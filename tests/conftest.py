"""What several test files start from.

The process that hands out the tests reads this file, too: fixtures import what takes long.
"""

import gc
import os
import shutil
import signal
import sys

import pytest
from browsing import SOFTWARE_GL, Explored, browser
from small_project import SMALL


def pytest_addoption(parser):
    text = "factorise with SuperLU, as where pypardiso is not installed"
    parser.addoption("--superlu", action="store_true", help=text)


def pytest_configure(config):
    # each worker has a processor: a second thread of BLAS would only wait, and twice as much time is spent
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if config.getoption("--superlu"):
        sys.modules["pypardiso"] = None  # found by no import


def pytest_sessionstart():
    """Answer Ctrl-C as Python does, also where the parent ignores it, as for jobs in the background.

    Some tests raise SIGINT, and a process that they start inherits whether it is ignored.
    """
    if os.environ.get("CI") and "PYTEST_XDIST_WORKER" not in os.environ:
        from pcmc.plot import scene as raster

        missing = [name for name in ("evolver", "ccx", "chromium", "pdftotext") if shutil.which(name) is None]
        missing += [] if raster.opengl() else ["OpenGL"]
        if missing:
            text = f"not installed here, so its tests would be skipped: {', '.join(missing)}"
            pytest.exit(text, returncode=1)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ["PCMC_CACHE"] = "off"  # no test takes a roof that another run has solved


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path):
    """Look for no examples in files of tests, which have none."""
    found = yield
    return [one for one in found if type(one) is pytest.Module] if file_path.name[:5] == "test_" else found


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Look for no garbage among what stays until the end: a tenth of the time of collecting tests."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_runtestloop():
    """Nor while tests run: a twentieth of their time."""
    gc.freeze()
    try:
        return (yield)
    finally:
        gc.unfreeze()


@pytest.fixture(scope="session")
def small_cap():
    """A stable cap of few triangles, at rest under tension 0.6."""
    from generators import spherical_cap
    from pcmc import solve

    return solve(spherical_cap(0.25)).surface


@pytest.fixture
def small(tmp_path):
    """The file of a small project, alone in its folder."""
    path = tmp_path / "small.toml"
    path.write_text(SMALL, encoding="utf-8")
    return path


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder that a test works in, with a small project, roof.toml."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(SMALL, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="module")
def explorer():
    """The page of a hall, served."""
    from generators import bezier_hall
    from pcmc import explore

    running = explore.start(bezier_hall(edge_length=10.0), title="the hall")
    yield running
    running.close()


@pytest.fixture(scope="session")
def driver(tmp_path_factory):
    """A browser without a window, whose downloads are in ``downloads``."""
    folder = tmp_path_factory.mktemp("browser")
    running = browser(folder, *SOFTWARE_GL)
    running.downloads = folder / "downloads"
    yield running
    running.quit()


@pytest.fixture
def page(driver, explorer):
    """The page of the hall in the browser, with a session of its own."""
    return Explored(driver, f"{explorer.url}&session={explorer.open()[0]}")


@pytest.fixture(scope="module")
def hall_folder(tmp_path_factory):
    return tmp_path_factory.mktemp("project")


@pytest.fixture(scope="module")
def hall_roof(hall_folder):
    """The hall of ``explore_cases`` at its targets, as the page opens it."""
    from explore_cases import designed_hall

    return designed_hall(hall_folder)


@pytest.fixture
def hall_session(hall_roof):
    from pcmc.explore.session import Session, solved_start

    return Session(solved_start(hall_roof.surface))
