"""A sheet with strips of cloth, as it is printed (needs pdftoppm)."""

import subprocess

import pcmc
from pcmc.cloth import pattern_drawings
from pcmc.plan import Plan

plan = Plan([[0, 0], [10, 0], [10, 5], [0, 5]], edge_length=0.8, tension=7.0)
roof = pcmc.solve(plan.surface()).surface
pattern = pcmc.cutting_pattern(roof, width=1.9, allowance=0.05, hem=0.12, notches=1.5)
pattern_drawings(pattern, "m", sheet="A3", name="hall").write("hall.pdf")
page = ["-png", "-f", "2", "-l", "2", "-singlefile", "-scale-to", "1000"]
subprocess.run(["pdftoppm", *page, "hall.pdf", "cloth_sheet"], check=True)
