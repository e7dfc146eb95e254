"""A membrane hall under its weight, snow and wind: the roof by pcmc, the loads by CalculiX."""

import pandas as pd

import pcmc
from pcmc.plan import Divider, Plan
from pcmc.plot import panel

plan = Plan(  # metres and kilonewtons; the air under the roof has 0.3 kN/m²
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=0.6)],
    edge_length=0.6,
    patches={name: {"tension": 1.5, "pressure": 0.3} for name in ("west", "east")},
)
roof = pcmc.solve(plan.surface())
wind = pcmc.Wind({"west": 0.1})  # suction
model = pcmc.StructuralModel(
    roof,
    pcmc.Material(young=5e5, poisson=0.3, density=1.2),  # kN/m², and t/m³
    thickness=0.001,
    loads=[pcmc.SelfWeight(), pcmc.Snow(0.15), wind, (pcmc.Snow(0.1), wind)],
)
steps = [case.results for case in pcmc.analyse(model).cases]

sheets = roof.surface.patch_of_face < 2  # without the wall
rows = []
for step in steps:
    force = 0.001 * step.principal_stresses[sheets]  # stress times thickness, kN/m
    rows.append(
        {
            "step": step.name,
            "down, mm": round(-1000 * step.deflections.min()),
            "up, mm": round(1000 * step.deflections.max()),
            "least force, kN/m": round(force.min(), 2),
            "largest force, kN/m": round(force.max(), 2),
            "supports, kN": round(-step.reactions[:, 2].sum(), 2),
        }
    )
pd.DataFrame(rows).to_csv("load_case.csv", index=False)
shown = [(step.name, 1000 * step.deflections) for step in steps if step.name in ("snow", "wind")]
panel(
    [roof.surface] * 2,
    "load_case.png",
    scalars=[values for _, values in shown],
    titles=[name for name, _ in shown],
    label="deflection, mm",
    edges=False,
    width=900,
)
