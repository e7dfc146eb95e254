"""Solve, plot and explore with the installed wheel: ``python use_wheel.py CHECKOUT``, in an empty folder."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import urllib.request
from pathlib import Path

import pcmc

TIMEOUT = 120.0  # seconds that a server may take to start


def main(checkout: Path) -> None:
    """Run the three commands on a project file; an AssertionError if one does not do its work."""
    assert not Path(pcmc.__file__).resolve().is_relative_to(checkout), "pcmc is the checkout's"
    for name in ("generators", "studies", "pcmc_command"):
        assert importlib.util.find_spec(name) is None, f"the wheel installed {name}"
    command("solve", "roof.toml", "-o", "roof.pcmc", "-o", "roof.3dm")
    assert pcmc.certify(pcmc.read("roof.pcmc")).certified
    command("plot", "roof.pcmc", "error.png", "--colour", "error")
    for name in ("roof.png", "roof.3dm", "error.png"):
        assert Path(name).stat().st_size > 1000, f"{name} is empty"
    explore()
    print("the wheel solves, plots and explores")


def command(*words: str) -> None:
    """Run ``pcmc``; an error unless its exit code is 0."""
    subprocess.run(["pcmc", *words], check=True)


def explore() -> None:
    """Start the page's server, fetch the page, and stop the server."""
    words = ["pcmc", "explore", "roof.pcmc", "--no-browser"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+", line)))
            with urllib.request.urlopen(address, timeout=TIMEOUT) as page:
                assert "<title>" in page.read().decode(), "the page has no title"
        finally:
            server.terminate()


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
