"""Pictures of cutting patterns, of a roof under load, of forces along its members, and of its equilibria."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base import validate
from ..base.errors import OptionError, unknown
from ..base.files import PathLike
from ..base.units import NO_UNITS, Units
from ..forces.rooms import energy_at_volumes
from ..surface import Patch, Surface
from .curves import add_branches, add_legend, label_axes
from .figure import CURVES, INK, SMALL, TEXT, finish, grid, new, style
from .pictures import RED, draw, panel
from .scene import Image

if TYPE_CHECKING:
    from ..cloth import CuttingPattern
    from ..equilibria import Equilibria
    from ..solvers.continuation import Branch
    from ..structure import Analysis
    from ..structure.analysis import Case


def strains(pattern: CuttingPattern, path: PathLike | None = None, **options: Any) -> Image:
    """The strips of a cutting pattern on the roof, coloured by the larger principal strain of the cloth.

    ``options`` are as in ``draw``, such as ``view`` and ``width``.

    >>> from pcmc import cutting_pattern
    >>> flat = Surface([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], [[0, 1, 2], [0, 2, 3]], [0, 0],
    ...                [Patch("sail", 2.0, pressure=0.0)], fixed=range(4))
    >>> strains(cutting_pattern(flat, strips=2), width=200).shape[1]
    200
    """
    strips = pattern.strips
    starts = np.cumsum([0, *(len(strip.roof) for strip in strips[:-1])])
    faces = np.concatenate([strip.faces + start for strip, start in zip(strips, starts, strict=True)])
    owner = np.repeat(np.arange(len(strips)), [len(strip.faces) for strip in strips])
    patches = tuple(Patch(f"strip {strip.number}", 1.0) for strip in strips)
    roof = np.concatenate([strip.roof for strip in strips])
    cut = Surface(roof, faces, owner, patches, np.ones(len(roof), dtype=bool), plane=pattern.surface.plane)
    strain = np.concatenate([strip.strain for strip in strips])
    largest = 100.0 * np.take_along_axis(strain, np.abs(strain).argmax(axis=1)[:, None], axis=1)[:, 0]
    look: dict[str, Any] = {"label": "strain of the cloth, %", "supports": False, "edges": False} | options
    return draw(cut, path, scalars=largest, **look)


MOST = 6  # cases, or members, of a picture
BESIDE, HIGH = 3, 170  # members beside each other; pixels of a diagram
ACROSS: dict[str, Any] = {"linewidth": 0.9, "linestyle": "--"}
SMALL_SHARE = 0.02  # of the largest force: what is across and smaller is not drawn
SHOWN = ("deflection", "least force")


def under_load(
    analysis: Analysis,
    path: PathLike | None = None,
    *,
    what: str = "deflection",
    cases: tuple[str, ...] = (),
    units: Units | None = None,
    **options: Any,
) -> Image:
    """What a roof does under its cases, side by side; see ``pcmc.analyse``.

    Parameters
    ----------
    what : "deflection", along Π's normal, or "least force", the smaller principal membrane force; grey where
        it is not above 0, so that the membrane is slack and wrinkles.
    cases : names of those to draw; by default those with the largest displacements, six at most.
    units : of the scale; by default those of the model.
    options : as of ``panel``, such as ``views`` and ``width``.
    """
    validate.choice("what", what, SHOWN)
    units, surface = units or analysis.model.units, analysis.model.surface
    chosen = _chosen(analysis, cases, 1 if len(analysis.cases) > 1 else 0)
    if what == "deflection":
        scalars = [case.results.deflections for case in chosen]
        look: dict[str, Any] = {"label": f"deflection, {units.length or 'length'}"}
    else:
        scalars = [np.where(c.results.slack, np.nan, c.results.principal_forces[:, 0]) for c in chosen]
        known = [values[np.isfinite(values)] for values in scalars]
        most = max((float(values.max()) for values in known if len(values)), default=1.0)
        look = {"label": f"least membrane force, {units.tension}; grey: slack", "limits": (0.0, most)}
    parts = [(c.name, f"{100.0 * c.share:.0f} %", f"{100.0 * c.taut:.0f} %", c) for c in chosen]
    titles = [n if c.carried else f"{n}, at {share} of it, slack from {taut}" for n, share, taut, c in parts]
    look |= {"edges": False, "supports": False, "titles": titles}
    look |= {"columns": 1} if len(chosen) == 1 else {}
    return panel([surface] * len(chosen), path, scalars=scalars, **(look | options))


def member_forces(
    analysis: Analysis,
    path: PathLike | None = None,
    *,
    cases: tuple[str, ...] = (),
    members: tuple[str, ...] = (),
    units: Units | None = None,
    mark: str = "",
    width: int = 900,
) -> Image:
    """N, V and M along the beams of a roof under its cases; see ``pcmc.analyse``.

    V and M in the upright plane are solid, M above 0 with tension below; those across it are dashed, where
    they are not small.

    Parameters
    ----------
    cases : names of those to draw; by default the form-finding load, and those with the largest
        displacements, six at most.
    members : names of the beams; by default those with the largest moments, six at most.
    units : of the axes; by default those of the model.
    mark : a text in the corner, of a roof that is not in order.

    Raises
    ------
    OptionError : the model has no beams, or none of a name.
    """
    units, table = units or analysis.model.units, analysis.member_forces
    if not len(table):
        raise OptionError("the model has no beams: no forces along them to draw", what="analysis")
    drawn = [case.name for case in _chosen(analysis, cases, 0)]
    largest = analysis.members.groupby("member", sort=False)["M"].max()
    for name in members:
        if name not in largest:
            validate.refuse("members", name, "names of beams", hint=unknown("member", name, [*largest.index]))
    names = members or tuple(name for name in largest.index if name in largest.nlargest(MOST).index)
    force, length = units.force or "force", units.length or "length"
    rows = {"N": force, "V": force, "M": f"{force}·{length}"}
    columns = min(len(names), BESIDE)
    count = len(rows) * -(-len(names) // columns)
    figure = new(width, HIGH * count, pad=8.0)
    axes = grid(figure, count * columns, columns)
    for k, name in enumerate(names):
        own = table[table["member"] == name]
        for row, (column, unit) in enumerate(rows.items()):
            place = style(axes[(len(rows) * (k // columns) + row) * columns + k % columns])
            label_axes(place, f"along {name}, {length}" if column == "M" else "", f"{column}, {unit}")
            place.axhline(0.0, color=INK, linewidth=0.6)
            for color, case in zip(CURVES, drawn, strict=False):
                along = own[own["case"] == case]
                place.plot(along["s"], along[column], color=color, linewidth=1.1, label=case)
                across = along.get(f"{column}_across")
                if across is not None and np.abs(across).max() > SMALL_SHARE * np.abs(own[column]).max():
                    place.plot(along["s"], across, color=color, **ACROSS)
    for unused in axes:
        if not unused.lines:
            unused.remove()
    if any(line.get_linestyle() == ACROSS["linestyle"] for place in axes for line in place.lines):
        axes[0].plot([], [], color=INK, label="across", **ACROSS)
    handles, labels = axes[0].get_legend_handles_labels()
    look = {"fontsize": SMALL, "labelcolor": INK, "frameon": False}
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 4), **look)
    if mark:
        figure.suptitle(mark, x=0.01, ha="left", color=RED, weight="bold", fontsize=TEXT)
    return finish(figure, path)


def _chosen(analysis: Analysis, cases: tuple[str, ...], first: int) -> list[Case]:
    """The cases of these names; by default those with the largest displacements, from ``first`` on."""
    names = [case.name for case in analysis.cases]
    for name in cases:
        if name not in names:
            validate.refuse("cases", name, "names of cases", hint=unknown("case", name, names))
    by_size = sorted(names[1:], key=lambda name: -analysis[name].results.largest_displacement)
    by_size = [*names[: 1 - first], *by_size][:MOST]
    return [analysis[name] for name in cases or [name for name in names if name in by_size]]


BRANCH_VALUES = ("height", "energy", "volume")
MOST_PICTURES = 12
COLUMNS = 4  # at most
PICTURE = 420  # pixels across a picture


def equilibria(
    found: Equilibria,
    path: PathLike | None = None,
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
    validate.choice("y", y, BRANCH_VALUES)
    names = [line.name for line in found.lines]
    line = found.lines[names.index(validate.choice("along", along or names[0], names))] if names else None
    shown = found.found[:MOST_PICTURES]
    columns = max(1, min(COLUMNS, len(shown)))
    rows = max(1, -(-len(shown) // columns))
    figure = new(width, (0.45 * width if line else 0.0) + 0.26 * width * rows, pad=8.0)
    heights = [*([2.0] * (line is not None)), *([1.0] * rows)]
    places = figure.add_gridspec(len(heights), columns, height_ratios=heights)
    if line is not None:
        axes = style(figure.add_subplot(places[0, :]))
        own = found.branches[line.name]
        own = tuple(map(_at_volumes, own)) if y == "energy" else own
        branches = {f"branch {k}": branch for k, branch in enumerate(own, 1)}
        count = add_branches(axes, branches, "parameter", y)
        axes.axvline(line.value, color=INK, linewidth=0.6, linestyle=":")
        at = {"xytext": (4, 4), "textcoords": "offset points", "fontsize": TEXT, "color": INK}
        for k, height in enumerate(found.table[y][:MOST_PICTURES], 1):
            axes.plot(line.value, height, "o", color=INK, markersize=3.0, zorder=3)
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
        text = f"{k}: {kind}\nE = {one.energy:.5g}{units.behind('energy')}"
        axes.set_title(text, fontsize=SMALL, color=INK)
    return finish(figure, path)


def _at_volumes(branch: Branch) -> Branch:
    """The branch with energies as equilibria have them: at the volumes, where rooms prescribe these."""
    tables = (branch.points, branch.surfaces), (branch.events, branch.event_surfaces)
    energies = ([energy_at_volumes(surfaces[k]) for k in rows.index] for rows, surfaces in tables)
    points, events = (rows.assign(energy=own) for (rows, _), own in zip(tables, energies, strict=True))
    return replace(branch, points=points, events=events)
