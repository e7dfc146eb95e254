"""Sweeps: run a function over a grid of parameters, resumable, on any executor, one row per case.

Gives ``Sweep``, ``run``, the store and its tables. Workers run each case in a process of its own, which loads
case_script.py. May import project and all rooms below.

>>> import pcmc.sweep
>>> halves = pcmc.sweep.Sweep("pcmc.sweep.examples:ratio", {"over": [1, 2]}, {"under": 2})
>>> pcmc.sweep.run(halves, workers=1)["value"].tolist()
[0.5, 1.0]
"""

from .grid import Sweep, checked
from .running import SweepProgress, run
from .solving import solve_case
from .store import Record, read_store
from .tables import draw_sweep, provenance, short_table, table, write_table

__all__ = ["Record", "Sweep", "SweepProgress", "checked", "draw_sweep", "provenance", "read_store", "run"]
__all__ += ["short_table", "solve_case", "table", "write_table"]
