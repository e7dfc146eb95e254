"""``margin``: how far an equilibrium is from the edge, what ends its stability, with an error bar.

As a target its slopes by tensions and loads have a closed form. At a fold the equations Bᵀ∇E = 0 have the
left null vector φ, the mode, as they are symmetric. Along a change dμ of a tension or a load the fold moves
so that ⟨φ, ∂∇E/∂λ⟩ dλ + ⟨φ, ∂∇E/∂μ⟩ dμ = 0, whatever the shape:

    dλ/dμ = - ⟨φ, ∂∇E/∂μ⟩ / ⟨φ, ∂∇E/∂λ⟩

(Govaerts 2000, ch. 4). A number that λ multiplies changes its ∂μ by λ, too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import lru_cache, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats
from ..base.errors import OptionError, PcmcError, SurfaceError
from ..base.tolerances import AT_REST, EVENT_ACCURACY
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate, Verdict, certify
from ..certificate.balance import pressures_left_over
from ..certificate.certificate import certified
from ..certificate.diagnosis import worst_face
from ..certificate.measures import Measurement
from ..certificate.quantities import dimension_of
from ..certificate.verdict import only_coarse
from ..forces.cables import heavy_cable_pulls
from ..forces.functional import by_rates
from ..forces.pinching import standing_part
from ..forces.triangles import heavy_triangle_pulls
from ..solvers import solve_once
from ..solvers.continuation import Branch, Ending
from ..solvers.continuation.branch import follow_until
from ..solvers.continuation.branch_point import ALONG
from ..solvers.result import Callback, Progress, Result, unless_stopped
from ..surface import Surface
from ..surface.geometry import vertex_area_vectors
from ..surface.lagrange import expect_flat
from ..surface.pieces import point_text
from .extrapolation import USUAL, extrapolate
from .mesh_check import CURVES, check_mesh, with_bar
from .persistence import shape_order
from .varied import Varied

FIRST, LARGEST = 0.05, 0.15  # the first and the longest step along the branch, as of ``follow``
SHORTER, FINEST = 0.25, 1e-4  # of a step on which contact and index change; where they count as one
HEAVY = (heavy_triangle_pulls, heavy_cable_pulls)  # what a weight may leave under compression
BEYOND = 0.01  # of λ: how far beyond the last point of a lost branch the surface is solved once more


class MarginEnd(Enum):
    """What ends the stability. The value is a few words.

    >>> MarginEnd.FOLD.value
    'fold: beyond it this equilibrium is gone'
    """

    FOLD = "fold: beyond it this equilibrium is gone"
    BIFURCATION = "bifurcation: beyond it the equilibrium is a saddle"
    CONTACT = "contact: a ridge comes to rest or lifts off, and a saddle is left"
    WALL_DOWN = "wall down: a ridge comes down on the held bottom of its wall, where it cannot rest"
    COMPRESSION = "compression: the weight of a sheet or cable is more than its tension holds"
    NONE = "no end found: it was followed no further"
    MESH = "the mesh gave out: it could not be followed further"


@dataclass(frozen=True, eq=False)
class End:
    """The end of stability on one mesh."""

    ends_by: MarginEnd
    factor: float  # λ there
    surface: Surface  # there
    motion: Floats  # (n,3) the change of the surface on the last step before; zeros where the mesh changed
    contacts: tuple[float, ...] = ()  # λ at which ridges come to rest or lift off before
    detail: str = ""  # the last difficulty of a branch that was lost


def find_end(
    surface: Surface, varied: Varied, index: int, most: float, callback: Callback | None = None
) -> End:
    """Follow the equilibria of a surface of this index until it rises, λ turns, or a part is compressed.

    Where the contact with Π changes on the last step, too, that is repeated in smaller ones, which tell the
    two apart. Raises KeyboardInterrupt where ``callback`` raises StopIteration, or for Ctrl-C.
    """
    sense, contacts = (1.0 if varied.more else -1.0), list[float]()
    branch, step = _follow(surface, varied, index, most, callback, LARGEST), LARGEST
    while True:
        events, end = branch.events, branch.points.arclength.iloc[-1]
        begin = branch.points.arclength.iloc[max(len(branch.points) - 2, 0)]
        touches = events.kind == "contact"
        contacts += events.parameter[touches & (events.arclength <= begin)].tolist()
        ended = events[(events.kind == "fold") | ((events.kind == "index") & (events.index_after > index))]
        unclear = (touches & (events.arclength > begin)).any() and len(ended)
        if not unclear or step <= FINEST:
            break
        step = SHORTER * min(end - begin, step)
        branch = _follow(branch.surfaces[len(branch.points) - 2], varied, index, most, callback, step)
    squeezed, there, detail = _compression(branch), branch.last, ""
    kind, factor = MarginEnd.NONE, float(branch.points.parameter.iloc[-1])
    if squeezed is not None and (ended.empty or sense * (squeezed - ended.parameter.iloc[0]) <= 0.0):
        kind, factor = MarginEnd.COMPRESSION, squeezed
    elif len(ended):
        row = int(ended.index[0])
        event: Any = events.loc[row]
        factor, there = float(event.parameter), branch.event_surfaces[row]
        touched = (touches & (events.arclength == event.arclength)).any()
        kind = MarginEnd.CONTACT if touched else MarginEnd.BIFURCATION
        if event.kind == "fold" or event.along_branch >= ALONG:
            kind = MarginEnd.FOLD
    elif branch.ending is not Ending.REACHED:
        detail = branch.detail
        # a solve a little beyond its last point tells what a branch that was lost ends by
        beyond = varied.direction.line(there).surface_at(there, factor + sense * BEYOND * max(factor, 1.0))
        down = unless_stopped(solve_once(beyond)).certificate.verdict is Verdict.WALL_DOWN
        kind = MarginEnd.WALL_DOWN if down else MarginEnd.MESH
        if detail.startswith("triangles"):
            worst = there.faces[worst_face(there, standing_part(there).walls.pinchable)[0]]
            detail += f" near {point_text(there.vertices[worst].mean(axis=0), there.size)}"
    last = branch.last.vertices
    before = branch.surfaces.get(len(branch.points) - 2, branch.last).vertices
    motion = last - before if before.shape == last.shape else np.zeros_like(last)
    return End(kind, factor, there, motion, tuple(contacts), detail)


def _follow(
    surface: Surface, varied: Varied, index: int, most: float, callback: Callback | None, largest: float
) -> Branch:
    """The branch as far as it is stable, and a point further."""
    sense = 1.0 if varied.more else -1.0

    def over(progress: Progress) -> bool:
        row = progress.row
        left = row["index"] > index or sense * row["slope"] < 0.0
        return left or any((pulls(progress.surface()) <= 0.0).any() for pulls in HEAVY)

    goal, first = most if varied.more else 1.0 / most, min(FIRST, largest)
    return follow_until(over, callback, surface, varied.direction, goal, step=first, largest=largest)


def _compression(branch: Branch) -> float | None:
    """λ at which an α + w z̄ or τ + g z̄ reaches 0, linear between the last two points; None if none does."""
    parameters, surfaces = branch.points.parameter.tolist()[-2:], [*branch.surfaces.values()][-2:]
    if len(parameters) < 2:
        return None
    ends = []
    for pulls in HEAVY:
        before, after = (pulls(surface).min(initial=np.inf) for surface in surfaces)
        if after <= 0.0:
            ends.append(float(np.interp(0.0, [after, before], parameters[::-1])))
    return min(ends, key=lambda end: abs(end - parameters[0]), default=None)


MOST = 10.0  # times, up or down: a margin this wide is no worry of a designer's
INFLATES = 0.5  # |∫ φ·ν dA| over ∫ |φ| dA from which a mode φ moves a patch to one side
OPEN = (MarginEnd.NONE, MarginEnd.MESH)  # ends that leave the margin open above


@dataclass(frozen=True, eq=False)
class Margin:
    """How far a surface at rest is from the edge. ``print`` shows a sentence.

    A bar is an estimate, infinite from one mesh, where meshes end differently, or show no limit.
    """

    what: str  # what is varied, such as "pressure" or "tension of west"
    more: bool  # whether it grows
    factor: float  # times the present value up to which the equilibrium stays stable; NaN where that is 0
    values: Mapping[str, float]  # at that end, by label, such as {"pressure of roof": 1.43}, in units of each
    bar: float  # how far the limit of ``factor`` (where that is NaN: of the value) may be on finer meshes
    limit: float  # the number extrapolated to ever finer meshes; NaN without a limit in sight
    limit_bar: float
    ends_by: MarginEnd  # what ends it; with NONE and MESH the margin is at least this
    detail: str  # what else is to be known: ridges that come to rest on the way, the finer mesh, symmetry
    surface: Surface = field(repr=False)  # at the end
    mode: Floats = field(repr=False)  # (n,3) the motion in which it leaves the equilibrium; (0,3) without one
    where: str  # what moves most in it, such as "'north' inflates"; empty without a mode
    index: int  # of the surface given; a saddle is followed until it has more ways down
    dimension: str = ""  # of the values, as a name of ``Units``

    @property
    def value(self) -> float:
        """The value at the end; NaN where several differ."""
        values = set(self.values.values())
        return values.pop() if len(values) == 1 else math.nan

    def numbers(self) -> dict[str, Any]:
        """For tables: the factor, or of what is 0 now the value, its bar, and what ends it."""
        of = f"{self.what}.margin"
        number = {f"{of}_value": self.value} if math.isnan(self.factor) else {of: self.factor}
        return {**number, f"{of}_error": self.bar, f"{of}_ends_by": self.ends_by.name.lower()}

    def text(self, units: Units = NO_UNITS) -> str:
        """The margin in a sentence."""
        holds = f"stays a saddle of index {self.index}" if self.index else "holds"
        none_now = math.isnan(self.factor)
        number = self.value if none_now else self.factor
        many = {"tension": "tensions", "cable": "tensions of the cables", "cable_weight": "weights of cables"}
        of = many.get(self.what, self.what)
        at_least, mesh = self.ends_by in OPEN, " on this mesh" * (self.ends_by is MarginEnd.MESH)
        shown = f"{number:.4g}" if at_least else with_bar(number, self.bar)
        shown += f"{units.behind(self.dimension)} of {self.what}" if none_now else f" times the {of}"
        then = f": then {self.where}" if self.where else ""
        holds += f"{mesh}{' at least' * at_least} {'up' if self.more else 'down'} to"
        text = f"{holds} {shown}{then} ({self.ends_by.value})"
        return "; ".join(filter(None, (text, self.detail)))

    __repr__ = text


def margin(
    surface: Surface | Result,
    what: str,
    *,
    towards: str | None = None,
    most: float = MOST,
    meshes: int = 3,
    corners: npt.ArrayLike = (),
    callback: Callback | None = None,
    certificate: Certificate | None = None,
) -> Margin:
    """The factor on a load or a tension up to which an equilibrium stays stable, and what ends it.

    The branch of equilibria is followed from the surface (``pcmc.follow``) until its index rises or the
    parameter turns back, whichever comes first. On a mesh whose symmetry is broken a branch that would
    end at a bifurcation bends away instead, and ends at a fold a little before, or not at all.

    Parameters
    ----------
    what : ``"pressure"``, ``"snow"``, ``"weight"`` and ``"tension"`` (both with cables), ``"cable"``,
        ``"cable_weight"`` or ``"volume"``: all of a kind in proportion; or one of them, such as
        ``"pressure of hall"``; the name of a patch or cable alone means its tension. What is 0 now is added,
        alike on all patches or cables.
    towards : ``"more"`` or ``"less"``; by default loads and walls pull more, sheets and cables less.
    most : followed up to this factor, or down to 1 over it; of what is 0 now, up to so many times the
        largest pressure, or tension over size.
    meshes : for the bar, in all, each once refined from the one before; 2 take order 2, and may not have it.
    corners : as of ``pcmc.check_mesh``.
    callback : called with a ``Progress`` at each step; StopIteration in it ends with KeyboardInterrupt.
    certificate : of the surface, if known.

    Raises
    ------
    OptionError : an unknown name, with the nearest known one; nothing depends on it; it cannot become less.
    SurfaceError : the surface is not at rest.

    Examples
    --------
    A cap over the unit disc folds as a hemisphere, at p = 2 α; here on a coarse mesh:

    >>> from pcmc import Patch, solve
    >>> angle = 2 * np.pi * np.arange(12) / 12
    >>> rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    >>> disc = Surface([[0, 0, 0.3], *rim], [[0, k + 1, (k + 1) % 12 + 1] for k in range(12)], [0] * 12,
    ...                [Patch("cap", 0.8)], fixed=range(1, 13))
    >>> from pcmc.meshing.refinement import refine
    >>> found = margin(solve_once(refine(disc, 1, lambda X: X / np.hypot(*X.T[:2])[:, None])), "pressure")
    >>> found.ends_by.name, found.where, bool(abs(found.factor - 1.6) <= found.bar)
    ('FOLD', 'the roof inflates', True)
    """
    if isinstance(surface, Result):
        certificate, surface = surface.certificate, surface.surface
    if not isinstance(surface, Surface):
        validate.refuse("surface", type(surface).__name__, "a Surface or a Result", error=SurfaceError)
    expect_flat(surface, "margin")
    validate.number("most", most, above=1.0)
    validate.integer("meshes", meshes, least=1)
    varied = Varied.of(surface, what, towards)
    validate.callback("callback", callback, "a function of a Progress")
    certificate = certified(surface, True, certificate)
    if (index := certificate.index) is None:
        message = f"margin: the surface is not at rest, so it has none ({certificate.verdict.value})"
        raise SurfaceError(message, what="surface", found=certificate.residual)
    find = partial(find_end, varied=varied, index=index, most=most, callback=callback)
    end, unit, notes = find(surface), varied.unit or 1.0, list[str]()
    ends, order, curves = [end], USUAL, 0.0
    if meshes > 1 and end.ends_by is not MarginEnd.NONE:
        try:
            check = check_mesh(surface, meshes, corners=corners, callback=callback)
            order = shape_order(check.surfaces)
            ends += map(find, check.surfaces[1:] if check.persists else ())
            others = map(find, check.other_curves * check.persists)
            curves = CURVES * sum(abs(other.factor - ends[1].factor) for other in others)
            doubt = "" if check.persists else f"the mesh check finds that the roof {check.verdict.value}"
        except PcmcError as error:
            ends, doubt = ends[:1], str(error)
        values = [(one.surface.m, unit * one.factor, one.ends_by.value.partition(":")[0]) for one in ends[1:]]
        shown = ", ".join(f"on {m} triangles {value:.4g} ({why})" for m, value, why in values)
        notes.append(f"no bar: {doubt}" if doubt else shown)
    numbers = np.array([[unit * one.factor] for one in ends])
    seen = numbers if {one.ends_by in OPEN for one in ends} == {False} else numbers[:1]
    bars = extrapolate(seen, EVENT_ACCURACY * abs(numbers[0]), shape_order=order, doubt=unit * curves)
    if not math.isfinite(bars.error[0]):
        notes.insert(0, only_coarse(end.surface, standing_part(end.surface).walls.pinchable))
    mode, dimensions = _mode(end, index), {dimension_of(kind) for kind, _ in varied.parts}
    if end.contacts:
        at = ", ".join(f"{unit * factor:.4g}" for factor in end.contacts)
        notes.append(f"ridges come to rest, or lift off, on the way: at {at}")
    symmetric = ", ".join(certificate.symmetric_in)
    notes += [pressures_left_over(end.surface), symmetric and f"among shapes symmetric in {symmetric}"]
    return Margin(
        what=varied.what,
        more=varied.more,
        factor=math.nan if varied.unit else end.factor,
        values=varied.at(end.factor),
        bar=float(bars.error[0]),
        limit=float(bars.limit[0]),
        limit_bar=float(bars.limit_error[0]),
        ends_by=end.ends_by,
        detail="; ".join(filter(None, (end.detail, *notes))),
        surface=end.surface,
        mode=mode,
        where=_where(end, mode),
        index=index,
        dimension=dimensions.pop() if len(dimensions) == 1 else "",
    )


def _mode(end: End, index: int) -> Floats:
    """(n,3) the motion that loses its stiffness at the end, with the sign in which a branch goes on."""
    if end.ends_by in OPEN:
        return np.empty((0, 3))
    modes = certify(end.surface, modes=index + 1).modes
    mode = modes[index] if len(modes) > index else end.motion
    return -mode if (mode * end.motion).sum() < 0.0 else mode


def _where(end: End, mode: Floats) -> str:
    """What moves most in a mode, and how."""
    surface = end.surface
    motion = np.linalg.norm(mode, axis=1)
    if not motion.any():
        return ""
    roof, most = np.flatnonzero(surface.roof), int(motion.argmax())
    (through, size), outward = np.zeros((2, len(surface.patches))), 0.0
    for k in roof:
        vectors, areas = vertex_area_vectors(surface.vertices, surface.faces[surface.patch_of_face == k])
        through[k], size[k] = (mode * vectors).sum(), motion @ areas
        outward += mode[most] @ vectors[most]
    near = np.unique(surface.patch_of_face[(surface.faces == most).any(axis=1)])
    largest = int(roof[size[roof].argmax()]) if len(roof) else int(near[0])
    turns = end.ends_by is MarginEnd.BIFURCATION  # to either side
    if abs(through[largest]) >= INFLATES * size[largest] > 0.0 and not (turns and len(near) > 1):
        part = "the roof" if len(roof) == 1 else repr(surface.patches[largest].name)
        return f"{part} {'inflates' if through[largest] > 0.0 else 'sinks'}{' or the opposite' * turns}"
    names = " | ".join(surface.patches[k].name for k in near[:3]) + " …" * (len(near) > 3)
    part = f"the junction {names}" if len(near) > 1 else repr(surface.patches[near[0]].name)
    way = "sways to one side" if turns or len(near) > 1 else f"moves {'out' if outward > 0.0 else 'in'}"
    return f"{part} {way}, most near {point_text(surface.vertices[most], surface.size)}"


@lru_cache(maxsize=4)
def _known(surface: Surface, what: str) -> Margin | None:
    """Of the last surfaces, as value and slopes are asked for one after the other; None if not at rest."""
    certificate = certify(surface)
    at_rest = certificate.residual <= AT_REST
    return margin(surface, what, meshes=1, certificate=certificate) if at_rest else None


def measured_margin(surface: Surface, of: str | None) -> Measurement:
    """The factor of ``pcmc.margin``, on this mesh alone; constant without an end, NaN if not at rest."""
    what = of or "pressure"
    if surface.rooms:
        text = f"margin of {what}: as a target it needs rooms of given pressures, not volumes"
        raise OptionError(text, what="of", found=what)
    varied = Varied.of(surface, what)
    if varied.unit:
        raise OptionError(f"margin of {what}: it is 0 now, so it has no factor", what="of", found=what)
    found, still = _known(surface, what), np.zeros_like(surface.vertices)
    if found is None or not len(found.mode):
        return Measurement(math.nan if found is None else found.factor, still)
    if found.ends_by is not MarginEnd.FOLD:
        text = f"margin of {what}: as a target it has to end by a fold, and it ends otherwise"
        raise OptionError(f"{text} ({found.ends_by.value})", what="of", found=what)
    end, phi, slopes = found.surface, found.mode, dict[str, Floats]()
    along = float((phi * varied.direction.line(end).gradient(end, end.vertices)).sum())
    walls = {(k, p.name) for k, _ in varied.parts if varied.what == k for p in end.patches if p.wall}
    for kind in ("tension", "pressure", "weight", "snow", "cable", "cable_weight"):
        names = [part.name for part in (end.cables if "cable" in kind else end.patches)]
        across = np.array([(phi * by_rates(end, {f"{kind}s": one})[1]).sum() for one in np.eye(len(names))])
        multiplied = [(kind, name) in {*varied.parts, *walls} for name in names]
        slopes[f"{kind}s"] = -across * np.where(multiplied, found.factor, 1.0) / along
    return Measurement(found.factor, still, slopes)
