"""The plan of a roof with its panels, ridges and setting-out points, as it is printed (needs pdftoppm)."""

import subprocess

import pcmc
from pcmc.drawings import drawing_set
from pcmc.plan import Divider, Plan

plan = Plan(
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=1.5)],
    edge_length=1.0,
    patches={"west": {"tension": 5.0}, "east": {"tension": 4.5}},
)
roof = pcmc.solve(plan.surface())
drawing_set(roof.surface, "m", sheet="A3", tolerance=0.02, name="hall").write("hall.pdf")
subprocess.run(["pdftoppm", "-png", "-singlefile", "-scale-to", "1000", "hall.pdf", "drawings"], check=True)
