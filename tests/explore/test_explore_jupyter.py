"""Explore inside JupyterLab: the page in a cell's output, and its surface in the next cell."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest
from browsing import SOFTWARE_GL, Explored, browser, needs_browser, until

TOKEN = "local"
HOME = Path(__file__).resolve().parents[2]
CELLS = [
    "import pcmc, generators\nview = pcmc.explore.show(generators.spherical_cap(0.25))\nview",
    "print('tension', view.surface.patches[0].tension)",
]


@pytest.fixture
def lab(tmp_path):
    """A JupyterLab of its own, with a notebook of the two cells; its address."""
    import nbformat  # here, as it takes seconds to import

    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(c) for c in CELLS])
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3"}
    nbformat.write(notebook, tmp_path / "cap.ipynb")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    places = ("JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_DATA_DIR", "IPYTHONDIR")
    own = {place: str(tmp_path / place.lower()) for place in places}
    path = os.pathsep.join(filter(None, [str(HOME), os.environ.get("PYTHONPATH", "")]))
    command = [
        sys.executable,
        "-m",
        "jupyterlab",
        "--no-browser",
        "--allow-root",
        f"--port={port}",
        "--ServerApp.port_retries=0",
        f"--IdentityProvider.token={TOKEN}",
        f"--notebook-dir={tmp_path}",
        "--LabApp.news_url=None",
        "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate",
    ]
    with (tmp_path / "log").open("w") as log:
        running = subprocess.Popen(
            command, env=os.environ | own | {"PYTHONPATH": path}, stdout=log, stderr=log
        )
        address = f"http://127.0.0.1:{port}"

        def ready():
            assert running.poll() is None, (tmp_path / "log").read_text()
            try:
                with urllib.request.urlopen(f"{address}/api?token={TOKEN}", timeout=2):
                    return True
            except OSError:
                return False

        until(ready, "JupyterLab", 120)
        yield f"{address}/lab/tree/cap.ipynb?token={TOKEN}"
        running.terminate()
        running.wait(30)


@pytest.mark.nightly
@needs_browser
def test_the_page_is_a_cells_output_and_its_surface_is_in_the_next(lab, tmp_path):
    from selenium.common.exceptions import WebDriverException
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    driver = browser(tmp_path / "browser", *SOFTWARE_GL)
    try:
        driver.get(lab)

        def cells():
            return driver.find_elements("css selector", ".jp-CodeCell .cm-content")

        def prompts():
            return driver.find_elements("css selector", ".jp-CodeCell .jp-InputPrompt")

        def started(number):
            """Run a cell; before the kernel is there JupyterLab forgets about it."""
            try:
                cells()[number].click()
            except (IndexError, WebDriverException):  # still on its way, or under the splash
                return False
            keys = ActionChains(driver).key_down(Keys.SHIFT).send_keys(Keys.ENTER)
            keys.key_up(Keys.SHIFT).perform()
            time.sleep(1.0)
            return prompts()[number].text != "[ ]:"

        def run(number):
            until(lambda: started(number), f"cell {number} to run", 120)

        run(0)
        frames = until(
            lambda: driver.find_elements("css selector", "iframe[title='pcmc explore']"), "the page", 120
        )
        driver.switch_to.frame(frames[0])
        page = Explored(driver)
        assert page.verdict == "stable"
        page.enter("Tension α of cap", 0.75)
        assert page.verdict == "stable"
        driver.switch_to.default_content()
        run(1)
        until(
            lambda: "tension 0.75" in driver.find_element("css selector", ".jp-Notebook").text,
            "the second cell's output",
        )
    finally:
        driver.quit()
