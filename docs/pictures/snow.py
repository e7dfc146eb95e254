"""Snow on one bay: the same roof without snow and with it, coloured by height."""

import pcmc
from pcmc.plan import Divider, Plan
from pcmc.plot import panel

plan = Plan(
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=1.5)],
    edge_length=0.5,
    patches={"west": {"tension": 5.0}, "east": {"tension": 5.0}},
)
bare = plan.surface()
snowy = bare.retensioned(snows={"east": 0.3})
roofs = [pcmc.solve(start).surface for start in (bare, snowy)]
heights = [roof.vertices[:, 2] for roof in roofs]
titles = ["no snow", "0.3 kN/m² on the right"]
panel(roofs, "snow.png", scalars=heights, titles=titles, label="height", width=900)
