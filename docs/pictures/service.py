"""Who talks to whom when Rhino, Grasshopper or Blender use pcmc."""

import matplotlib.pyplot as plt

figure, axis = plt.subplots(figsize=(7.5, 1.7), layout="constrained")
boxes = {
    0.0: ("Rhino, Grasshopper,\nBlender", "with COMPAS", "#dbe9f6"),
    4.4: ("pcmc's service", "127.0.0.1, with a secret", "#fde3d6"),
    8.8: ("pcmc", "in a Python of its own", "#d9f0e6"),
}
for x, (name, where, colour) in boxes.items():
    axis.add_patch(plt.Rectangle((x, 0), 2.6, 1.2, facecolor=colour, edgecolor="#333333"))
    axis.text(x + 1.3, 0.72, name, ha="center", va="center", fontsize=10)
    axis.text(x + 1.3, 0.2, where, ha="center", va="center", fontsize=8, color="#444444")
for x, there, back in ((2.6, "meshes, tensions", "roof, certificate"), (7.0, "surface", "result")):
    axis.annotate("", (x + 1.8, 0.85), (x, 0.85), arrowprops={"arrowstyle": "->"})
    axis.annotate("", (x, 0.35), (x + 1.8, 0.35), arrowprops={"arrowstyle": "->"})
    axis.text(x + 0.9, 0.92, there, ha="center", fontsize=8)
    axis.text(x + 0.9, 0.12, back, ha="center", fontsize=8)
axis.set_xlim(-0.1, 11.5)
axis.set_ylim(-0.1, 1.3)
axis.set_axis_off()
figure.savefig("service.png", dpi=100)
