"""Half of a symmetric hall is designed; the picture has the whole."""

import pcmc
from pcmc.plan import Divider, Plan
from pcmc.plot import panel

half = Plan(
    [[0, 0], [9, 0], [9, 8], [0, 8]],
    [Divider([[5, 0], [5, 8]], wall=1.5)],
    mirrors=[[[9, 0], [9, 8]]],
    edge_length=0.5,
    patches={"aisle": {"tension": 5.0}, "nave": {"tension": 5.0}},
)
roof = pcmc.solve(half.surface()).surface
panel([roof, pcmc.mirrored(roof)], "mirrored.png", titles=["half", "the whole"], width=900)
