"""The forces along an arch in the place of a wall, by CalculiX."""

import pcmc
from pcmc.base.units import Units
from pcmc.plan import Divider, Plan
from pcmc.plot import member_forces

plan = Plan(  # metres and kilonewtons
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=0.6)],
    edge_length=0.8,
    patches={name: {"tension": 1.5, "pressure": 0.3} for name in ("west", "east")},
)
arch = pcmc.Member("wall 1", pcmc.Profile.tube(0.1016, 0.005), pcmc.Material(2.1e8, density=7.85))
model = pcmc.StructuralModel(
    pcmc.solve(plan.surface()),
    pcmc.Material(young=5e5, poisson=0.3, density=1.2),
    thickness=0.001,
    loads=[pcmc.SelfWeight(), pcmc.Snow(0.15)],
    members=[arch],
)
member_forces(pcmc.analyse(model), "members.png", cases=("form pressure", "snow"), units=Units("m", "kN"))
