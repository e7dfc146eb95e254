"""CalculiX's printed results, ``.dat``: by node, and by integration point of each element."""

from __future__ import annotations

import re

from ..base.errors import FileError
from .blocks import Block, by_step, numbers

HEAD = re.compile(r"^ *([a-z]+) \((.*)\) for set (\S+) and time +(\S+)[^\S\n]*$", re.M)
COLUMNS = {"displacements": (1, 3), "forces": (1, 3), "stresses": (2, 6)}  # numbers before the values, values


def read(text: str) -> list[dict[str, Block]]:
    """The tables of each step.

    >>> text = " displacements (vx,vy,vz) for set NALL and time  0.1000000E+01\\n\\n 2 0.5 0. -1.E-3\\n"
    >>> read(text)[0]["displacements"].values.tolist()
    [[0.5, 0.0, -0.001]]
    """
    heads = list(HEAD.finditer(text))
    if not heads:
        raise FileError("has no results; is it a .dat file of ccx, and has its analysis run?")
    ends = [*(head.start() for head in heads[1:]), len(text)]
    blocks = []
    for head, end in zip(heads, ends, strict=True):
        kind, line = head[1], text.count("\n", 0, head.start()) + 1
        if kind not in COLUMNS:
            continue
        keys, values = COLUMNS[kind]
        body = re.sub(r"[^\S\n]_\S+", "", text[head.end() : end])  # names of local axes
        rows = numbers(body.split(), keys + values, kind, line)
        time = numbers([head[4]], 1, "time", line)[0, 0]
        if head[3] == "CABLES":
            kind = "cables"
        blocks.append(Block(kind, float(time), rows[:, 0].astype(int), rows[:, keys:], keys == 1))
    return by_step(blocks)
