"""CalculiX's results for viewers, ``.frd`` in ASCII: columns of fixed width, all by node."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np

from ..base.arrays import Floats, Ints
from ..base.errors import FileError
from .blocks import Block, by_step, numbers

KINDS = {"DISP": ("displacements", 3), "FORC": ("forces", 3), "STRESS": ("stresses", 6)}
KEY, NUMBER = 13, 12  # characters: " -1" and the node; each value
STRESS_ORDER = [0, 1, 2, 3, 5, 4]  # xx, yy, zz, xy, yz, zx in the file
HEAD = re.compile(r"^(?:    2C|    3C|  100C|    1P| 9999).*$", re.M)


def read(text: str) -> list[dict[str, Block]]:
    """The tables of each step. Values have six digits."""
    if not text.startswith("    1C") or "\n  100C" not in text:
        raise FileError("has no results; is it an .frd file of ccx in ASCII, and has its analysis run?")
    if not text.rstrip().endswith("9999"):
        raise FileError("the file is cut off: its last line is not 9999; run ccx again")
    heads = list(HEAD.finditer(text))
    blocks, nodes, places = [], np.empty(0, dtype=int), np.empty((0, 3))
    for head, following in pairwise(heads):
        body, line = text[head.end() : following.start()], text.count("\n", 0, head.start()) + 1
        if head[0].startswith("    2C"):
            nodes, places = _table(body, 3, "nodes", line)
        elif head[0].startswith("  100C"):
            name = re.search(r"^ -4  (\w+)", body, re.M)
            if name is None or name[1] not in KINDS:
                continue
            kind, count = KINDS[name[1]]
            ids, values = _table(body, count, kind, line)
            if kind == "stresses":
                values = values[:, STRESS_ORDER]
            time = float(numbers([head[0][12:24]], 1, "time", line)[0, 0])
            known = np.isin(ids, nodes).all() and len(nodes) == len(ids)
            blocks.append(Block(kind, time, ids, values, True, places if known else None))
    return by_step(blocks)


def _table(body: str, columns: int, what: str, line: int) -> tuple[Ints, Floats]:
    """The rows that start with -1, of equal length: node numbers (k,) and values (k,columns)."""
    rows = [row for row in body.split("\n") if row.startswith(" -1")]
    width = KEY + NUMBER * columns
    if not rows or any(len(row) < width for row in rows) or "\n -3" not in body:
        raise FileError(f"line {line}: the {what} are cut off; run ccx again", where=line)
    words = [row[k : k + NUMBER] for row in rows for k in range(KEY, width, NUMBER)]
    try:
        ids = np.array([row[3:KEY] for row in rows], dtype=int)
    except ValueError as error:
        raise FileError(f"line {line}: the {what} cannot be read ({error})", where=line) from None
    return ids, numbers(words, columns, what, line)
