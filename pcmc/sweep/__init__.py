"""Run a function over a grid of parameters: resumable, on any executor, one row per case.

>>> import pcmc.sweep
>>> halves = pcmc.sweep.Sweep("pcmc.sweep.examples:ratio", {"over": [1, 2]}, {"under": 2})
>>> pcmc.sweep.run(halves, workers=1)["value"].tolist()
[0.5, 1.0]
"""

from .grid import Sweep, checked
from .running import Progress, run
from .solving import solve_case
from .store import Record, read_store
from .table import provenance, table, write_table

__all__ = [
    "Progress",
    "Record",
    "Sweep",
    "checked",
    "provenance",
    "read_store",
    "run",
    "solve_case",
    "table",
    "write_table",
]
