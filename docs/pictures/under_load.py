"""A hall under wind and snow by zones: deflections of four cases, by CalculiX."""

import pcmc
from pcmc.plan import Divider, Plan
from pcmc.plot import under_load

plan = Plan(  # metres and kilonewtons
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=0.6)],
    edge_length=0.4,
    patches={name: {"tension": 1.5, "pressure": 0.3} for name in ("west", "east")},
)
valley = [[4, 0], [8, 0], [8, 8], [4, 8]]
model = pcmc.StructuralModel(
    pcmc.solve(plan.surface()),
    pcmc.Material(young=5e5, poisson=0.3, density=1.2),
    thickness=0.001,
    loads=[
        pcmc.SelfWeight(),
        pcmc.Snow(0.15),
        pcmc.Wind({"west": 0.1, "east": 0.05}),
        pcmc.Snow(0.5, area=valley, name="drift in the valley"),
    ],
    combinations={"uls": {"snow": 1.5, "wind": 0.9}},
    units=pcmc.base.units.Units("m", "kN"),
)
analysis = pcmc.analyse(model)
print(analysis)
cases = ("snow", "wind", "drift in the valley", "uls")
under_load(analysis, "under_load.png", cases=cases, limits=(-0.03, 0.03), width=900)
