"""The equilibria of a surface: their branches with folds and bifurcations, and a picture of each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..base import validate
from ..base.units import NO_UNITS, Units
from .curves import add_branches, add_legend, label_axes
from .figure import INK, SMALL, TEXT, Image, Path, finish, new, style
from .pictures import draw

if TYPE_CHECKING:
    from ..equilibria import Equilibria

SHOWN = ("height", "energy", "volume")
MOST = 12  # pictures
COLUMNS = 4  # at most
PICTURE = 420  # pixels across a picture


def equilibria(
    found: Equilibria,
    path: Path | None = None,
    *,
    along: str | None = None,
    y: str = "height",
    units: Units = NO_UNITS,
    width: int = 1200,
    view: Any = "diagonal",
) -> Image:
    """The branches of ``pcmc.find_equilibria``, solid where stable, and the equilibria with their numbers.

    Parameters
    ----------
    along : the parameter of the horizontal axis; by default the first that was followed. Without one there
        are pictures alone.
    y : of the vertical axis: "height", "energy" or "volume".
    units, view : of the numbers, and of the pictures, as in ``draw``.

    Folds and changes of index are marked; a dotted line is the present value. At most 12 are pictured.
    """
    validate.choice("y", y, SHOWN)
    names = [line.name for line in found.lines]
    line = found.lines[names.index(validate.choice("along", along or names[0], names))] if names else None
    shown = found.found[:MOST]
    columns = min(COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    figure = new(width, (0.45 * width if line else 0.0) + 0.26 * width * rows, pad=8.0)
    heights = [*([2.0] * (line is not None)), *([1.0] * rows)]
    places = figure.add_gridspec(len(heights), columns, height_ratios=heights)
    if line is not None:
        axes = style(figure.add_subplot(places[0, :]))
        branches = {f"branch {k}": branch for k, branch in enumerate(found.branches[line.name], 1)}
        count = add_branches(axes, branches, "parameter", y)
        axes.axvline(line.value, color=INK, linewidth=0.6, linestyle=":")
        for k, height in enumerate(found.table[y][:MOST], 1):
            axes.plot(line.value, height, "o", color=INK, markersize=3.0, zorder=3)
            at = {"xytext": (4, 4), "textcoords": "offset points", "fontsize": TEXT, "color": INK}
            axes.annotate(str(k), (line.value, height), **at)
        margin = 0.03 * (line.span[1] - line.span[0])
        axes.set_xlim(line.span[0] - margin, line.span[1] + margin)
        label_axes(axes, line.name, y + units.behind("length" if y == "height" else y))
        add_legend(axes, len(branches) + count)
    for k, one in enumerate(shown, 1):
        row, column = divmod(k - 1, columns)
        axes = figure.add_subplot(places[row + (line is not None), column])
        axes.imshow(draw(one.surface, view=view, width=PICTURE, supports=False, edges=False))
        axes.axis("off")
        kind = "stable" if one.index == 0 else f"saddle, index {one.index}"
        energy = f"E = {one.energy:.5g}{units.behind('energy')}"
        axes.set_title(f"{k}: {kind}\n{energy}", fontsize=SMALL, color=INK)
    return finish(figure, path)
