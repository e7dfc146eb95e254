"""A sail on masts with stays, in elevation, as it is printed (needs pdftoppm)."""

import subprocess

import pcmc
from pcmc.drawings import drawing_set
from pcmc.plan import Plan
from pcmc.structure import drawn_members

corners = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]  # metres and kilonewtons
plan = Plan(
    [corner[:2] for corner in corners],
    edge="cable",
    cable=9.0,
    supports=corners,
    tension=1.0,
    pressure=0.0,
)
tube, rope = pcmc.Profile.tube(0.1143, 0.005), pcmc.Profile(3e-4, 1e-9)
masts = {"mast 1": [[0, 0], [0, 0]], "mast 2": [[10, 10], [10, 10]]}
stays = {"stay 1": [[0, 0], [-3, -1]], "stay 2": [[0, 0], [-1, -3]]}
members = [pcmc.Member(ends, tube, pcmc.Material(2.1e8), name=name) for name, ends in masts.items()]
members += [pcmc.Member(ends, rope, pcmc.Material(1.6e8), "cable", name=name) for name, ends in stays.items()]
sail = pcmc.solve(plan.surface())
model = pcmc.StructuralModel(sail, pcmc.Material(5e5), thickness=0.001, cable_area=1e-4, members=members)
about = {"sheet": "A3", "name": "sail", "members": drawn_members(model)}
drawing_set(sail.surface, "m", **about).write("sail.pdf")
sheet = ["-f", "2", "-l", "2", "-scale-to", "1400", "sail.pdf", "masts"]
subprocess.run(["pdftoppm", "-png", "-singlefile", *sheet], check=True)
