"""The same roof with other triangles, finer where patches meet."""

import pcmc
from pcmc.meshing.remeshing import remesh
from pcmc.plan import Divider, Plan
from pcmc.plot import panel

plan = Plan(
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=1.5)],
    edge_length=1.2,
    patches={"west": {"tension": 5.0}, "east": {"tension": 4.5}},
)
coarse = pcmc.solve(plan.surface()).surface
fine = pcmc.solve(remesh(coarse, 0.6, near_curves=0.3)).surface
titles = [f"{surface.m} triangles" for surface in (coarse, fine)]
panel([coarse, fine], "remeshing.png", titles=titles, edges=True, width=900)
