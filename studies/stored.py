"""Stored results beside the code of today: which come from other code, and which a new run gives again."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from pcmc.base.arrays import Floats
from pcmc.base.errors import PcmcError

from .code import code_at, code_of
from .study import Study, git

if TYPE_CHECKING:
    from rich.console import Console

# two runs give the same number if it differs by less than
SAME = 1e-6  # of its size: other processors and libraries round sums otherwise
NOTHING = 1e-9  # or this, about 0, where all is rounding
SECONDS = "times.csv"  # how the names of tables of seconds end
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


def ages(studies: Iterable[Study], results: Path) -> dict[str, Age | None]:
    """The age of each study's result by the study's name; None where there is none.

    A part is other if its hash is: comments, docstrings and the layout of the code do not count. The code at
    the run is that of its commit, or where git does not have it, that of the hashes in the provenance.
    """
    stored: dict[str, dict[str, Any]] = {}
    modules: dict[str, list[str]] = {}  # by the commit of their run
    studies = list(studies)
    for study in studies:
        path = results / study.name / "provenance.json"
        if path.is_file():
            stored[study.name] = json.loads(path.read_text(encoding="utf-8"))
            modules.setdefault(_commit(stored[study.name]), []).append(study.data.__module__)
    code = {commit: code_at(commit, names) for commit, names in modules.items() if commit}
    found: dict[str, Age | None] = {}
    for study in studies:
        if study.name not in stored:
            found[study.name] = None
            continue
        provenance, module = stored[study.name], study.data.__module__
        at_run = code[commit][module] if (commit := _commit(provenance)) else provenance.get("code")
        changed = None if at_run is None else differing(at_run, code_of(module))
        counted = git("rev-list", "--count", f"{provenance['commit']}..HEAD")
        found[study.name] = Age(study.name, changed, int(counted) if counted else None)
    return found


def _commit(provenance: Mapping[str, Any]) -> str:
    """The commit whose code made a result; empty where git does not have it."""
    if provenance.get("uncommitted_changes"):
        return ""
    return git("rev-parse", "--verify", "--quiet", f"{provenance['commit']}^{{commit}}")


def differing(stored: Mapping[str, str], now: Mapping[str, str]) -> tuple[str, ...]:
    """The parts of the code whose hashes differ; the study's own files first.

    >>> differing({"pcmc/forces": "1", "pcmc/base": "2"}, {"pcmc/forces": "1", "studies/a.py": "3"})
    ('studies/a.py', 'pcmc/base')
    """
    parts = sorted({*stored, *now}, key=lambda part: (not part.startswith("studies"), part))
    return tuple(part for part in parts if stored.get(part) != now.get(part))


def check(study: Study, results: Path, console: Console, **options: Any) -> list[str]:
    """Run a study anew, elsewhere; a line for each column of its tables that is not as stored in ``results``.

    What it reads of other studies is what is stored; ``options`` are those of ``run_all``.
    """
    from .runner import run_all  # here, as it needs rich

    with tempfile.TemporaryDirectory() as scratch:
        anew = Path(scratch)
        for other in (path for path in results.iterdir() if path.is_dir() and path.name != study.name):
            (anew / other.name).symlink_to(other.resolve(), target_is_directory=True)
        (outcome,) = run_all([study], anew, console, steps=("data", "table"), **options)
        if outcome.error:
            raise PcmcError(f"{study.name}: {outcome.error}")
        return differences(results / study.name, anew / study.name)


def differences(stored: Path, anew: Path) -> list[str]:
    """A line for each table of two folders that only one has, and for each column that differs.

    Tables of seconds are left out: they are never the same.
    """
    lines = []
    for name in sorted({path.name for folder in (stored, anew) for path in folder.glob("*.csv")}):
        if name.endswith(SECONDS):
            continue
        if not (stored / name).is_file() or not (anew / name).is_file():
            lines.append(f"{stored.name}/{name}: only {'stored' if (stored / name).is_file() else 'now'}")
        else:
            found = between(pd.read_csv(stored / name), pd.read_csv(anew / name))
            lines += [f"{stored.name}/{name}: {line}" for line in found]
    return lines


def between(stored: pd.DataFrame, anew: pd.DataFrame) -> list[str]:
    """A line for each column that is not the same in two tables, with the cell that differs most.

    Rows of ``measured``, which have keys, are put side by side by these.

    >>> old = pd.DataFrame({"case": ["a", "b"], "x": [1.0, 2.0]})
    >>> between(old, old.assign(x=[1.0 + 1e-9, 2.1]))
    ['x, 1 of 2 rows, most in row 3 (b): stored 2, now 2.1']
    """
    if "key" in stored and "key" in anew:
        keys = sorted({*stored.key, *anew.key})
        stored, anew = (frame.set_index("key").reindex(keys).reset_index() for frame in (stored, anew))
    lines = [
        f"{column}: only {'stored' if column in stored else 'now'}"
        for column in dict.fromkeys([*stored, *anew])
        if not (column in stored and column in anew)
    ]
    if len(stored) != len(anew):
        return [*lines, f"stored {len(stored)} rows, now {len(anew)}"]
    for column in (column for column in stored if column in anew):
        old, new = stored[column], anew[column]
        by = _apart(old, new)
        if by.any():
            row = int(by.argmax())
            whose = "" if column == stored.columns[0] else f" ({stored.iloc[row, 0]!s})"
            lines.append(
                f"{column}, {np.count_nonzero(by)} of {len(by)} rows, most in row {row + 2}{whose}:"
                f" stored {_shown(old.iloc[row])}, now {_shown(new.iloc[row])}"
            )
    return lines


def _apart(old: pd.Series[Any], new: pd.Series[Any]) -> Floats:
    """(k,) By how much cells differ, 0 within the tolerances, infinite for words and for empty ones."""
    if not (is_numeric_dtype(old) and is_numeric_dtype(new)):
        words = np.array(
            [
                one != other and not (one != one and other != other)
                for one, other in zip(old, new, strict=True)
            ]
        )
        return np.where(words, np.inf, 0.0)
    one, other = old.to_numpy(float), new.to_numpy(float)
    same = np.isclose(one, other, rtol=SAME, atol=NOTHING, equal_nan=True)
    with np.errstate(invalid="ignore"):
        size = np.abs(one - other) / np.maximum(np.maximum(np.abs(one), np.abs(other)), NOTHING)
    return np.where(same, 0.0, np.nan_to_num(size, nan=np.inf, posinf=np.inf))


def _shown(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else f"{value!s}"
