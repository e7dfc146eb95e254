"""A dome that encloses a given volume; its pressure is a result."""

import pcmc
from pcmc.plan import Plan
from pcmc.plot import draw

plan = Plan(
    {"circle": {"centre": [0, 0], "radius": 3}},
    edge_length=0.35,
    patches={"dome": {"tension": 2.0, "volume": 40.0}},
)
result = pcmc.solve(plan.surface())
pressure = result.surface.pressures[0]
draw(result.surface, "dome.png", width=600, title=f"40 m³ under {pressure:.3f} kN/m²")
