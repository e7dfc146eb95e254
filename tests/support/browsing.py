"""A real browser without a window, for tests of pages."""

from __future__ import annotations

import io
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")
needs_browser = pytest.mark.skipif(
    not (BROWSER and DRIVER),
    reason="chromium or chromedriver is not installed (Debian: apt install chromium chromium-driver)",
)

FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--window-size=1280,860",
    "--force-device-scale-factor=1",
)  # fmt: skip
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def browser(folder: Path, *flags: str) -> Any:
    """Chromium with a profile and downloads of its own under the folder."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = str(BROWSER)
    for flag in (*FLAGS, *flags, f"--user-data-dir={folder / 'profile'}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    options.add_experimental_option("prefs", {"download.default_directory": str(folder / "downloads")})
    return webdriver.Chrome(options=options, service=webdriver.ChromeService(str(DRIVER)))


def until(condition: Callable[[], Any], what: str, seconds: float = 60.0) -> Any:
    """The first true value of the condition."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise AssertionError(f"waited {seconds} s in vain: {what}")


class Explored:
    """The page as a user sees and handles it."""

    def __init__(self, driver: Any, url: str = "") -> None:
        """Open the address; without one, the page is there already."""
        self.driver = driver
        if url:
            driver.get("about:blank")  # the page before may go on asking a server that has ended
            self.complaints()
            driver.get(url)
        self.idle()

    def find(self, selector: str) -> Any:
        return self.driver.find_element("css selector", selector)

    def text(self, selector: str) -> str:
        return str(self.find(selector).text)

    @property
    def verdict(self) -> str:
        return str(self.find("#verdict").get_attribute("data-verdict"))

    def idle(self) -> None:
        """Until every answer is there and drawn."""
        until(lambda: self.find("#verdict").get_attribute("data-busy") == "false", "the page to be idle")
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()))"
        )

    def slider(self, name: str) -> Any:
        return self.find(f"input[type=range][aria-label='{name}']")

    def number(self, name: str) -> Any:
        return self.find(f"input.number[aria-label='{name}, as a number']")

    def enter(self, name: str, value: float) -> None:
        from selenium.webdriver.common.keys import Keys

        # NULL lets go of the control key
        self.number(name).send_keys(Keys.CONTROL + "a" + Keys.NULL, str(value), Keys.TAB)
        self.idle()

    def picture(self) -> np.ndarray:
        """(h,w,3) the middle of the canvas, where nothing lies over it."""
        from matplotlib.image import imread

        shot = imread(io.BytesIO(self.find("#canvas").screenshot_as_png))[..., :3]
        h, w = shot.shape[:2]
        return shot[int(0.4 * h) : int(0.78 * h), int(0.1 * w) : int(0.9 * w)]

    def complaints(self) -> list[str]:
        """Warnings and errors in the browser's console since the last call."""
        return [f"{entry['level']}: {entry['message']}" for entry in self.driver.get_log("browser")]


def changed(before: np.ndarray, after: np.ndarray, by: float = 0.1) -> float:
    """The part of the pixels that differ visibly."""
    return float((np.abs(after - before).max(axis=2) > by).mean())
