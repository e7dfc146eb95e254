"""Stored results beside the code of today: which come from other code, and which a new run gives again."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from .code import code_of
from .paper import read_measured
from .study import Study, git, perform

SAME = 1e-6  # relative: other processors and libraries round sums otherwise
NOTHING = 1e-9  # a difference between numbers about 0 that is rounding
SHOWN = 4  # parts of the code named in a line


@dataclass(frozen=True)
class Age:
    """How a stored result stands to the code of today.

    Attributes
    ----------
    study : its name.
    changed : the parts of its code that are other than at its run; None where no hashes are stored.
    commits : how many commits ago it was computed; None where git does not know the commit.
    """

    study: str
    changed: tuple[str, ...] | None
    commits: int | None

    def __str__(self) -> str:
        when = "" if self.commits is None else f"; computed {self.commits} commits ago"
        if self.changed is None:
            return f"stale: its provenance has no hashes of its code{when}"
        if not self.changed:
            return f"up to date{when}"
        more = len(self.changed) - SHOWN
        rest = f" and {more} more" if more > 0 else ""
        return f"stale: other code in {', '.join(self.changed[:SHOWN])}{rest}{when}"


def age(study: Study, results: Path) -> Age | None:
    """The age of a study's result; None where there is none.

    A part is other if its hash is: comments, docstrings and the layout of the code do not count.
    """
    path = results / study.name / "provenance.json"
    if not path.is_file():
        return None
    stored = json.loads(path.read_text(encoding="utf-8"))
    counted = git("rev-list", "--count", f"{stored['commit']}..HEAD")
    commits = int(counted) if counted else None
    if "code" not in stored:
        return Age(study.name, None, commits)
    return Age(study.name, differing(stored["code"], code_of(study.data.__module__)), commits)


def differing(stored: Mapping[str, str], now: Mapping[str, str]) -> tuple[str, ...]:
    """The parts of the code whose hashes differ; the study's own files first.

    >>> differing({"pcmc/forces": "1", "pcmc/base": "2"}, {"pcmc/forces": "1", "studies/a.py": "3"})
    ('studies/a.py', 'pcmc/base')
    """
    parts = sorted({*stored, *now}, key=lambda part: (not part.startswith("studies"), part))
    return tuple(part for part in parts if stored.get(part) != now.get(part))


def check(study: Study, results: Path) -> list[str]:
    """Run a study anew, elsewhere; a line for each of its numbers that is not as stored in ``results``."""
    with tempfile.TemporaryDirectory() as scratch:
        perform(study, Path(scratch), steps=("data", "table"))
        return differences(read_measured(results), read_measured(Path(scratch)), study.name)


def differences(stored: Mapping[str, float], anew: Mapping[str, float], study: str) -> list[str]:
    """A line for each number of a study that is not the same in both.

    >>> differences({"a.x": 1.0, "a.y": 2.0, "b.x": 9.0}, {"a.x": 1.0 + 1e-9, "a.y": 2.1}, "a")
    ['a.y: stored 2, now 2.1']
    """
    keys = sorted(key for key in {*stored, *anew} if key.startswith(f"{study}."))
    pairs = ((key, stored.get(key, math.nan), anew.get(key, math.nan)) for key in keys)
    return [f"{key}: stored {old:.9g}, now {new:.9g}" for key, old, new in pairs if not _same(old, new)]


def _same(one: float, other: float) -> bool:
    return math.isclose(one, other, rel_tol=SAME, abs_tol=NOTHING) or (one != one and other != other)


def ages(studies: Iterable[Study], results: Path) -> dict[str, Age | None]:
    """The age of each study's result by the study's name."""
    return {study.name: age(study, results) for study in studies}
