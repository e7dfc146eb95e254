"""An L-shaped roof with a courtyard: three patches whose walls meet at 120 degrees."""

import pcmc
from pcmc.plan import Divider, Hole, Plan
from pcmc.plot import draw

ends = [[10, 10], [0, 9.5096], [9.5096, 0]]
plan = Plan(
    [[0, 0], [24, 0], [24, 10], [10, 10], [10, 24], [0, 24]],
    [Divider([[7.5, 7.5], end], wall=1.0) for end in ends],
    holes=[Hole({"circle": {"centre": [17, 5], "radius": 2}}, name="courtyard")],
    edge_length=0.7,
    patches={
        "corner": {"tension": 6.0, "at": [3, 3]},
        "north": {"tension": 6.0, "at": [5, 20]},
        "east": {"tension": 6.0, "at": [20, 8]},
    },
)
roof = pcmc.solve(plan.surface()).surface
draw(roof, "courtyard.png", width=600)
