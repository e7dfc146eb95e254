"""The tables of numbers in CalculiX's ``.dat`` files, by step, by node and integration point."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError

WHOLE = 1e-6  # of a step: a time so near to its end is the end
EXPONENT = re.compile(r"(?<=\d)([+-]\d{3})\b")  # Fortran leaves out the E before three digits
DAT_HEAD = re.compile(r"^ *([a-z]+) \((.*)\) for set (\S+) and time +(\S+)[^\S\n]*$", re.M)
DAT_COLUMNS = {"displacements": (1, 3), "forces": (1, 3), "stresses": (2, 6)}  # keys and values of a row


@dataclass(frozen=True, eq=False)
class ResultBlock:
    """One quantity of one step, by ascending numbers of nodes or elements."""

    kind: str  # displacements, forces, stresses, or cables: the stresses of these; ends: forces of beams'
    time: float  # at the end of the step
    ids: Ints  # (k,) numbers of nodes or elements
    values: Floats  # (k,3) vectors, or (k,6) stresses xx, yy, zz, xy, xz, yz
    before: ResultBlock | None = None  # the same at the increment before, in the same step

    def means(self, elements: Ints) -> Floats:
        """(k,c) the mean over the integration points of each of the elements (k,), ascending numbers."""
        chosen = np.isin(self.ids, elements)
        place = np.searchsorted(elements, self.ids[chosen])
        sums = [np.bincount(place, column, len(elements)) for column in self.values[chosen].T]
        return np.stack(sums, axis=1) / np.bincount(place, minlength=len(elements))[:, None]


def read(text: str) -> list[dict[str, ResultBlock]]:
    """The tables of each step, which end at the times 1, 2, ...; of several in a step the last counts, so
    that of an analysis that stopped the last step's is what it reached. Each has the one ``before`` it.

    >>> text = " displacements (vx,vy,vz) for set NALL and time  0.1000000E+01\\n\\n 2 0.5 0. -1.E-3\\n"
    >>> read(text)[0]["displacements"].values.tolist()
    [[0.5, 0.0, -0.001]]
    """
    steps: list[dict[str, ResultBlock]] = []
    for block in _blocks(text):
        number = max(math.ceil(block.time - WHOLE), 1)
        steps += [{} for _ in range(number - len(steps))]
        earlier = steps[number - 1].get(block.kind)
        steps[number - 1][block.kind] = replace(block, before=earlier)
    return steps


def _blocks(text: str) -> Iterator[ResultBlock]:
    heads = list(DAT_HEAD.finditer(text))
    if not heads:
        raise FileError("has no results; is it a .dat file of ccx, and has its analysis run?")
    for head, end in zip(heads, [*(head.start() for head in heads[1:]), len(text)], strict=True):
        kind, line = head[1], text.count("\n", 0, head.start()) + 1
        if kind not in DAT_COLUMNS:
            continue
        keys, values = DAT_COLUMNS[kind]
        body = re.sub(r"[^\S\n]_\S+", "", text[head.end() : end])  # names of local axes
        rows = _numbers(body.split(), keys + values, kind, line)
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        time = float(_numbers([head[4]], 1, "time", line)[0, 0])
        kind = {"CABLES": "cables", "ENDS": "ends"}.get(head[3], kind)
        yield ResultBlock(kind, time, rows[:, 0].astype(int), rows[:, keys:])


def _numbers(words: list[str], columns: int, what: str, line: int) -> Floats:
    """(k,columns) the words of a table; an error names the table and the line where it starts."""
    try:
        values = np.array(words, dtype=float)
    except ValueError:
        try:
            values = np.array([EXPONENT.sub(r"E\1", word) for word in words], dtype=float)
        except ValueError as error:
            raise FileError(f"line {line}: the {what} cannot be read ({error})", where=line) from None
    if len(values) % columns or not len(values):
        raise FileError(f"line {line}: the {what} are cut off; run ccx again", where=line)
    table = values.reshape(-1, columns)
    if not np.isfinite(table).all():
        raise FileError(f"line {line}: the {what} are not finite; the analysis failed", where=line)
    return table
