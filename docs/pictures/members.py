"""The forces along an arch in the place of a wall, by CalculiX."""

from matplotlib import pyplot as plt

import pcmc
from pcmc.plan import Divider, Plan

plan = Plan(  # metres and kilonewtons
    [[0, 0], [12, 0], [12, 8], [0, 8]],
    [Divider([[6, 0], [6, 8]], wall=0.6)],
    edge_length=0.8,
    patches={name: {"tension": 1.5, "pressure": 0.3} for name in ("west", "east")},
)
arch = pcmc.Member("wall 1", pcmc.Profile.tube(0.1016, 0.005), pcmc.Material(2.1e8, density=7.85))
model = pcmc.StructuralModel(
    pcmc.solve(plan.surface()),
    pcmc.Material(young=5e5, poisson=0.3, density=1.2),
    thickness=0.001,
    loads=[pcmc.SelfWeight(), pcmc.Snow(0.15)],
    members=[arch],
)
forces = pcmc.analyse(model).member_forces
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 4.5), layout="constrained")
for case, own in forces[forces["case"] != "self-weight"].groupby("case", sort=False):
    for axis, column in zip(axes, ("N", "M"), strict=True):
        axis.plot(own["s"], own[column], marker=".", label=case)
for axis, label in zip(axes, ("N, kN", "M, kN m"), strict=True):
    axis.axhline(0.0, color="0.6", linewidth=0.8)
    axis.set_ylabel(label)
axes[0].legend(frameon=False)
axes[1].set_xlabel("along the arch, m")
figure.savefig("members.png", dpi=110)
