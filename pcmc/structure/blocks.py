"""Tables of numbers in result files."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError

TENSOR = [[0, 3, 4], [3, 1, 5], [4, 5, 2]]  # where a tensor's entries are in xx, yy, zz, xy, xz, yz
EXPONENT = re.compile(r"(?<=\d)([+-]\d{3})\b")  # Fortran leaves out the E before three digits


@dataclass(frozen=True, eq=False)
class Block:
    """One quantity of one step.

    Attributes
    ----------
    kind : displacements, forces, stresses, or cables: the stresses of these.
    time : at the end of the step.
    ids : (k,) numbers of nodes or elements.
    values : (k,3) vectors, or (k,6) stresses xx, yy, zz, xy, xz, yz.
    by_node : whether the numbers are those of nodes.
    places : (k,3) where the nodes are, if the file has it.
    """

    kind: str
    time: float
    ids: Ints
    values: Floats
    by_node: bool
    places: Floats | None = None

    def in_order(self) -> Block:
        """The same, by ascending numbers."""
        order = np.argsort(self.ids, kind="stable")
        places = None if self.places is None else self.places[order]
        return replace(self, ids=self.ids[order], values=self.values[order], places=places)

    def means(self, elements: Ints) -> Floats:
        """(k,c) the mean over the integration points of each of the elements (k,), ascending numbers."""
        chosen = np.isin(self.ids, elements)
        place = np.searchsorted(elements, self.ids[chosen])
        count = np.bincount(place, minlength=len(elements))
        columns = self.values[chosen].T
        return (
            np.stack([np.bincount(place, column, len(elements)) for column in columns], axis=1)
            / count[:, None]
        )


def numbers(words: list[str], columns: int, what: str, line: int) -> Floats:
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


def by_step(blocks: list[Block]) -> list[dict[str, Block]]:
    """The blocks of each step, whose times are 1, 2, ...; of several in a step the last counts."""
    steps: list[dict[str, Block]] = []
    for block in blocks:
        number = round(block.time)
        if abs(block.time - number) > 1e-6 or number < 1:
            continue  # part of a step
        while len(steps) < number:
            steps.append({})
        steps[number - 1][block.kind] = block.in_order()
    return steps
