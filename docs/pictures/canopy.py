"""A canopy on four masts: cables along its edges, a sag that is asked for."""

import pcmc
from pcmc.plan import Plan
from pcmc.plot import draw

plan = Plan(
    [[0, 0], [10, 0], [10, 10], [0, 10]],
    edge="cable",
    cable=9.0,
    supports=[[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]],
    edge_length=0.6,
    tension=1.0,
    pressure=0.0,
    weight=0.01,
)
sail = pcmc.meet(plan.surface(), pcmc.Target("sag", "cable 1", 1.5), pcmc.Parameter("cable 1", "cable"))
draw(sail.surface, "canopy.png", width=600)
