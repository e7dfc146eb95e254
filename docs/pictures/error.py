"""A roof coloured by the error of its mean curvature, which is nearly all at the ends of the wall."""

import pcmc
from pcmc.plan import Divider, Plan
from pcmc.plot import draw

plan = Plan(
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=1.5)],
    edge_length=0.5,
    patches={"west": {"tension": 5.0}, "east": {"tension": 4.5}},
)
roof = pcmc.solve(plan.surface()).surface
error = 100 * pcmc.curvature_error(roof, method="cotangent")
draw(roof, "error.png", scalars=error, label="error of Meyer's mean curvature, %", edges=False, width=600)
