"""A project that several tests of the page start from."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from pcmc import explore
from pcmc.explore.roof import ShownRoof, read_roof

HALL_TOML = """# the hall
units = "m"
force = "kN"
[plan]
edge_length = 1.0  # coarse
outline = [[0, 0], [12, 0], [12, 6], [0, 6]]
[[plan.dividers]]
curve = [[6, 0], [6, 6]]
wall = 2.0  # the valley
[plan.patches]
west = {tension = 5.0}  # left
east = {tension = 5.0, pressure = 1}
[targets]  # two heights
meet = [{quantity = "apex", of = "west", value = 1.2}, {quantity = "apex", of = "east", value = 1.0}]
vary = ["west", "east"]
"""


def designed_hall(folder: Path) -> ShownRoof:
    """The roof of the project, which is written to the folder as hall.toml."""
    (folder / "hall.toml").write_text(HALL_TOML)
    return read_roof(folder / "hall.toml", use_cache=False)


@contextmanager
def followed(path: Path) -> Iterator[Any]:
    """The page of a project's file, served, which follows the file."""
    read = partial(read_roof, path, use_cache=False)
    running = explore.start(read(), watch=read)
    try:
        yield running
    finally:
        running.close()
