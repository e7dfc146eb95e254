"""Where a hall wrinkles under a drift of snow: its least membrane forces, by CalculiX."""

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
        pcmc.Snow(0.2, area=valley, name="a small drift"),
        pcmc.Snow(0.5, area=valley, name="drift in the valley"),
    ],
    units=pcmc.base.units.Units("m", "kN"),
)
analysis = pcmc.analyse(model, remedy=False)
cases = ("a small drift", "drift in the valley")
under_load(analysis, "slack.png", cases=cases, what="least force", width=900)
