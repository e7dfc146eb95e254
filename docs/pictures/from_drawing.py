"""A drawing becomes a roof: four layers of a DXF file, and what `pcmc solve drawing.dxf` makes of them."""

import ezdxf
import matplotlib.pyplot as plt
import numpy as np

import pcmc
from pcmc.plot import draw

LAYERS = {
    "outline": [(0, 0), (24, 0), (24, 10), (10, 10), (10, 24), (0, 24), (0, 0)],
    "divider a": [(7.5, 7.5), (10, 10)],
    "divider b": [(7.5, 7.5), (0, 9.51)],
    "divider c": [(7.5, 7.5), (9.51, 0)],
}
drawing = ezdxf.new(units=ezdxf.units.M)
space = drawing.modelspace()
for layer, points in LAYERS.items():
    space.add_lwpolyline(points, dxfattribs={"layer": layer})
space.add_circle((17, 5), 2, dxfattribs={"layer": "hole courtyard"})
drawing.saveas("drawing.dxf")
roof = pcmc.project.designed("drawing.dxf").surface

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained", width_ratios=[1, 1.6])
turn = np.linspace(0, 2 * np.pi)
left.plot(17 + 2 * np.cos(turn), 5 + 2 * np.sin(turn), "C3", lw=2)
left.text(17, 7.3, "hole courtyard", color="C3", ha="center", fontsize=9)
for layer, points in LAYERS.items():
    colour = "black" if layer == "outline" else "C0"
    left.plot(*np.transpose(points), color=colour, lw=2)
left.text(10.5, 17, "outline", fontsize=9)
left.text(1.5, 9.8, "divider b", color="C0", fontsize=9)
left.set_aspect("equal")
right.imshow(draw(roof, width=1000, supports=False))
for axis, title in ((left, "drawing.dxf"), (right, "pcmc solve drawing.dxf")):
    axis.set_axis_off()
    axis.set_title(title, family="monospace", fontsize=10)
figure.savefig("from_drawing.png", dpi=100)
