"""The height of a roof on finer and finer meshes, and the limit that the first three of them lead to."""

import pcmc
from pcmc.plan import Divider, Plan
from pcmc.plot import lines

plan = Plan(
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=1.5)],
    edge_length=1.2,
    patches={"west": {"tension": 5.0}, "east": {"tension": 4.5}},
)
result = pcmc.solve(plan.surface())
height = pcmc.check_mesh(result).row("height", "east")
print(height)
levels = [result, *(pcmc.solve(plan.surface(), levels=k) for k in (1, 2, 3))]
sizes = [1.2 / 2**k for k in range(4)]
heights = [level.surface.vertices[:, 2].max() for level in levels]
lines(
    {"on the mesh": (sizes, heights)},
    "mesh_check.png",
    x="edge length, m",
    y="height of the east bay, m",
    levels={"limit": height.limit},
    markers=True,
    width=700,
    height=420,
)
