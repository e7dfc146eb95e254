"""``find_equilibria``: branches, deflated Newton from many starts, and the ways down from each saddle."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np

from ..accuracy import check_mesh
from ..base import validate
from ..base.errors import NoBranch, OptionError, SurfaceError
from ..base.interrupts import stop_requested
from ..base.tolerances import AT_REST
from ..base.validate import check_options, flag, integer, limited
from ..certificate import certify
from ..certificate.verdict import only_coarse
from ..forces.loose_parts import part_size
from ..forces.pinching import standing_part
from ..solvers import solve
from ..solvers.continuation import BoundaryMotion, Branch, Direction
from ..solvers.result import Progress, Result, Status, unless_stopped
from ..solvers.starts import low_start
from ..surface import Surface, expect_surface
from ..surface.lagrange import expect_flat
from .branches import Span, TracedParameter, join_branches
from .found import Equilibria, FoundEquilibrium, WayDown, pairs
from .from_known import deflated_newton, pass_between, way_down, with_good_triangles
from .shapes import Shape

MODES = 8  # of the lowest modes a start is displaced along
FAR = (0.05, 0.3)  # of the size: how far a start is displaced
SAME_VALUE = 1e-4  # of the span: bifurcations of one shape nearer to each other than this are one
ENDS = {
    Status.DIVERGED: "inflates without bound",
    Status.VANISHED: "shrinks to nothing",
    Status.DEGENERATE: "pinches off or collapses",
}

Along = str | Direction | BoundaryMotion


@dataclass(frozen=True)
class SearchOptions:
    """How equilibria are searched for.

    Parameters
    ----------
    span : between which values of the parameter branches are followed; by default from half its present
        value to 1.5 times that, or from -4 to 4 where it is 0.
    starts : of deflated Newton around each equilibrium.
    depth : how often a branch may leave another at a bifurcation.
    most : equilibria; the search ends there.
    seed : of the random starts.
    mesh_check : whether ``check_mesh`` is done on each equilibrium.

    Examples
    --------
    >>> SearchOptions(starts=-1)
    Traceback (most recent call last):
        ...
    pcmc.base.errors.OptionError: starts: expected a whole number ≥ 0, found -1
    """

    span: Span | None = None
    starts: int = limited(6, integer)
    depth: int = limited(2, integer)
    most: int = limited(24, integer, least=1)
    seed: int = limited(0, integer)
    mesh_check: bool = limited(False, flag)

    def __post_init__(self) -> None:
        check_options(self)
        if self.span is not None:
            if not isinstance(self.span, Sequence) or len(self.span) != 2:
                validate.refuse("span", self.span, "two numbers, the least and the largest value")
            for value in self.span:
                validate.number("span", value)


def find_equilibria(
    surface: Surface | Result,
    along: Along | Sequence[Along] = "pressure",
    *,
    callback: Callable[[str], None] | None = None,
    **options: Any,
) -> Equilibria:
    """Search for all equilibria of a surface, with their indices, energies, and the barriers between them.

    Parameters
    ----------
    surface : a surface, or what ``solve`` gave; if it is not at rest, it is solved first.
    along : the parameters in which branches are followed, each as for ``margin`` ("pressure", "tension of
        roof", "volume") or ``follow``. A branch that folds or bifurcates leads back to further equilibria at
        the present value. None: ``()``.
    callback : called with a sentence at each step. Raise StopIteration in it to stop.
    options : fields of ``SearchOptions``.

    Returns
    -------
    Equilibria
        What was found, and what was searched. No search proves that there is no further equilibrium.

    Raises
    ------
    SurfaceError : the surface comes to rest from no start.
    OptionError : an unknown parameter or option, or a value out of range.

    Notes
    -----
    Three searches feed each other until nothing new is found. (1) Through each new equilibrium its branch is
    followed in each parameter, and from bifurcations those that leave it; where one passes the present value,
    there is an equilibrium. (2) Deflated Newton starts near it, displaced at random along its lowest modes.
    (3) From saddles the ways down lead to minima, and between two minima that no saddle joins the highest
    surface on the straight way is a start for the pass between them.

    Two equilibria are one if their shapes are nowhere farther apart than a quarter of an edge and their
    indices agree: other triangles change a shape by about as much. An equilibrium found with poor
    triangles is solved again on a new mesh (with the library mmgpy).

    Examples
    --------
    The film of tension 1 over a square tent, under a pressure of 0.9, is a pyramid of height h with
    E = 4 √(1 + h²) - 1.2 h: one equilibrium.

    >>> from pcmc import Patch
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 1]]
    >>> tent = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("tent", 1.0, 0.9)], fixed=range(4))
    >>> equilibria = find_equilibria(tent)
    >>> len(equilibria), equilibria[1].index, round(equilibria[1].height, 6)
    (1, 0, 0.314485)
    """
    given = surface.surface if isinstance(surface, Result) else surface
    expect_surface(given)
    expect_flat(given, "find_equilibria")
    validate.callback("callback", callback, "a function of a sentence")
    chosen = validate.options_from(SearchOptions, "find_equilibria", options)
    every = [along] if isinstance(along, Along) else validate.sequence("along", along)
    lines = [TracedParameter.of(given, what, chosen.span) for what in every]
    own = [x.name for x in lines]
    lines = [replace(x, name=f"{x.name} {k}") if own.count(x.name) > 1 else x for k, x in enumerate(lines, 1)]
    search = _Search(given, lines, chosen, callback)
    try:
        search.run()
    except (StopIteration, KeyboardInterrupt) as error:
        stop_requested(error)
        search.stopped = True
    return search.result()


@dataclass(eq=False)
class _Search:
    """What is known so far. Numbers count from 0 here, in the order in which equilibria are found."""

    surface: Surface
    lines: Sequence[TracedParameter]
    options: SearchOptions
    callback: Callable[[str], None] | None
    found: list[FoundEquilibrium] = field(default_factory=list)
    shapes: list[Shape] = field(default_factory=list)
    on_branch: set[tuple[str, int]] = field(default_factory=set)  # those that a branch in this has led to
    ways: list[WayDown] = field(default_factory=list)
    branches: dict[str, list[Branch]] = field(default_factory=lambda: defaultdict(list))
    left: dict[str, list[tuple[float, Shape]]] = field(default_factory=lambda: defaultdict(list))
    tried: set[tuple[int, int]] = field(default_factory=set)  # pairs of minima
    failed: list[str] = field(default_factory=list)
    early_ends: dict[tuple[str, str], list[float]] = field(default_factory=lambda: defaultdict(list))
    starts = arrived = 0
    stopped = False

    def run(self) -> None:
        self.tell("solving")
        self.first()
        for number, _ in enumerate(self.found):  # it grows on the way
            for line in self.lines:
                if (line.name, number) not in self.on_branch:
                    self.follow(line, number)
            self.descend(number)
            self.deflate(number)
            if number == len(self.found) - 1:
                self.connect()
        if self.options.mesh_check:
            for k, one in enumerate(self.found):
                self.tell(f"mesh check of equilibrium {k + 1}")
                self.found[k] = replace(one, mesh_check=check_mesh(one.surface))

    def tell(self, step: str) -> None:
        if self.callback is not None:
            self.callback(f"{step}; {len(self.found)} found")

    def first(self) -> None:
        """The surface given, solved if necessary, and the minimum from a low start."""
        if self.add(self.surface, "given") is None:
            result = unless_stopped(solve(self.surface))
            if not result.converged:
                result = unless_stopped(solve(self.surface, target="stationary"))
            if not result.converged:
                text = f"find_equilibria: no equilibrium was found to begin with; {result.message}"
                raise SurfaceError(text, what="surface", found=result.status.name)
            self.add(result.surface, "from the start given")
        if (low := low_start(self.surface)) is not None and (result := unless_stopped(solve(low))).converged:
            self.add(with_good_triangles(result.surface), "from a low start")

    def add(self, surface: Surface, how: str) -> int | None:
        """The number of an equilibrium, new if its shape or index is; None if it cannot be certified."""
        certificate = certify(surface, modes=min(MODES, surface.n))
        if certificate.index is None or certificate.residual > AT_REST:
            return None
        shape = Shape.of(surface)
        for k, other in enumerate(self.shapes):
            if certificate.index == self.found[k].index and shape.same_as(other):
                return k
        if len(self.found) >= self.options.most:
            self.failed.append(f"The search ended at {len(self.found)} equilibria; raise most to go on.")
            raise StopIteration
        self.found.append(FoundEquilibrium(surface, certificate, how))
        self.shapes.append(shape)
        if why := only_coarse(surface, standing_part(surface).walls.pinchable):
            self.failed.append(f"The equilibrium {how}: {why}.")
        return len(self.found) - 1

    def follow(self, line: TracedParameter, number: int) -> None:
        """The branch through an equilibrium, those that leave it, and the equilibria on them."""

        def watch(_: Progress) -> None:
            self.tell(f"following the {line.name} from equilibrium {number + 1}")

        start, how = self.found[number].surface, self.found[number].found
        if isinstance(line.parameter, BoundaryMotion) and start.pinned.sum() != self.surface.pinned.sum():
            text = f"The equilibrium {how} has a new mesh; no branch in {line.name} was followed from it"
            self.failed.append(f"{text}, as that moves the vertices of the boundary.")
            return
        try:
            halves = line.halves(start, watch)
        except NoBranch as error:
            self.failed.append(f"No branch in {line.name} starts at the equilibrium {how}: {error}.")
            return
        self.keep_early_ends(line, halves)
        level, how, led_to = [join_branches(*halves)], f"on a branch in {line.name}", {number}
        for depth in range(self.options.depth + 1):
            following = list[Branch]()
            for branch in level:
                self.branches[line.name].append(branch)
                for there, beside in line.crossings(branch):
                    self.cross(line, there, beside, how, led_to)
                if depth < self.options.depth:
                    following += self.leaving(line, branch, watch)
            self.keep_early_ends(line, following)
            level, how = following, f"on a branch in {line.name}, beyond a bifurcation"

    def keep_early_ends(self, line: TracedParameter, branches: Iterable[Branch]) -> None:
        for value, why in filter(None, map(line.early_end, branches)):
            self.early_ends[line.name, why].append(value)

    def told_early_ends(self) -> Iterator[str]:
        """A sentence for all branches of a parameter that ended for one reason."""
        for (name, why), values in self.early_ends.items():
            who, it = ("A branch", "it") if len(values) == 1 else (f"{len(values)} branches", "them")
            where = ", ".join(dict.fromkeys(f"{value:.4g}" for value in values))
            beyond = f"what lies beyond on {it} is not known. Try a finer mesh."
            yield f"{who} ended at {name} {where} {why}; {beyond}"

    def cross(
        self, line: TracedParameter, there: Surface | str, beside: str, how: str, led_to: set[int]
    ) -> None:
        """Add the equilibrium where a branch passes the present value, or tell why there is none.

        ``led_to`` are those that the branches it comes from have led to.
        """
        now = f"{line.name} {line.value:.4g}"
        k = None if isinstance(there, str) else self.add(with_good_triangles(there), how)
        if k is None:
            why = f"was not reached: {there}" if isinstance(there, str) else "cannot be certified"
            self.failed.append(f"A branch passes {now}, but its equilibrium there {why}.")
            return
        self.on_branch.add((line.name, k))
        if beside and k in led_to:
            back = f"the way from there to {line.value:.4g} leads back to a known equilibrium"
            self.failed.append(f"A branch left at {line.name} {beside}; {back}. Try a finer mesh.")
        led_to.add(k)

    def leaving(
        self, line: TracedParameter, branch: Branch, watch: Callable[[Progress], None]
    ) -> list[Branch]:
        """The branches that leave one at bifurcations that none has been left at before."""
        (low, high), found, known = line.span, list[Branch](), self.left[line.name]
        values: dict[Any, float] = branch.bifurcations.parameter.to_dict()
        for row, value in values.items():
            shape, near = Shape.of(branch.event_surfaces[row]), SAME_VALUE * (high - low)
            left = any(abs(value - at) <= near and shape.same_as(other) for at, other in known)
            if low < value < high and not left:
                known.append((value, shape))
                try:
                    found += line.leaving(branch, row, watch)
                except OptionError as error:
                    self.failed.append(f"At {line.name} {value:.4g} no branch was followed: {error}.")
        return found

    def descend(self, number: int) -> None:
        """The ways down from a saddle, on both sides of each unstable mode that is known."""
        one, ways = self.found[number], list[WayDown]()
        for mode in one.certificate.modes[: one.index]:
            self.tell(f"going down from equilibrium {number + 1}")
            for side in (mode, -mode):
                surface, status = way_down(one.surface, side)
                if status is Status.STOPPED:
                    raise KeyboardInterrupt
                to = None
                if status is Status.CONVERGED:
                    to = self.add(with_good_triangles(surface), "on the way down from a saddle")
                end = ENDS.get(status, f"leads to no known end ({status.name.lower()})") if to is None else ""
                ways.append(WayDown(number, to, end, lost=to is None and status not in ENDS))
        if one.index == 1:  # both at once, also where the search ends between them
            self.ways += ways
        ends = [way.end for way in ways]
        if any(ends) and (one.index > 1 or all(ends)):  # if one way of two leads on, a barrier has both
            lost = ", ".join(f"{end} ({ends.count(end)})" for end in sorted({*ends} - {""}))
            self.failed.append(f"The {len(ends)} ways down from a saddle of index {one.index}: {lost}.")

    def deflate(self, number: int) -> None:
        """Deflated Newton from starts around an equilibrium."""
        one, random = self.found[number], np.random.default_rng([self.options.seed, number])
        modes, size = one.certificate.modes, part_size(self.surface)
        unit = modes / np.linalg.norm(modes, axis=2).max(axis=1)[:, None, None]
        for _ in range(self.options.starts if len(modes) else 0):
            self.tell(f"deflated Newton around equilibrium {number + 1}")
            d = np.tensordot(random.standard_normal(len(unit)), unit, axes=1)
            d *= random.uniform(*FAR) * size / np.linalg.norm(d, axis=1).max()
            start = one.surface.moved(one.surface.onto_supports(one.surface.vertices + d))
            self.starts += 1
            result = deflated_newton(start, self.shapes)
            if result is not None and self.add(result.surface, "by deflation") is not None:
                self.arrived += 1

    def connect(self) -> None:
        """Try the straight way between minima that no saddle joins."""
        joined = [{one.to, other.to} for one, other in pairs(self.ways)]
        minima = [k for k, one in enumerate(self.found) if one.index == 0]
        for pair in combinations(minima, 2):
            one, other = (self.found[k].surface for k in pair)
            known = set(pair) in joined or pair in self.tried
            if known or not np.array_equal(one.faces, other.faces):
                continue
            self.tried.add(pair)
            self.tell("looking for a pass between two minima")
            if (result := pass_between(one, other)) is not None:
                self.add(result.surface, "between two minima")

    def result(self) -> Equilibria:
        """The equilibria by energy, the numbers of the ways down with them."""
        order = sorted(range(len(self.found)), key=lambda k: self.found[k].energy)
        number: dict[int | None, int] = {k: place for place, k in enumerate(order, 1)}
        ways = [replace(w, saddle=number[w.saddle], to=number.get(w.to)) for w in self.ways]
        branches = {line.name: tuple(self.branches[line.name]) for line in self.lines}
        searched = [
            f"Branches followed in {line.name}, from {line.span[0]:.4g} to {line.span[1]:.4g}"
            f" (now {line.value:.4g}): {len(branches[line.name])}."
            for line in self.lines
        ]
        searched.append(f"Deflated Newton: {self.starts} starts, {self.arrived} came to rest.")
        return Equilibria(
            found=tuple(self.found[k] for k in order),
            ways=tuple(sorted(ways, key=lambda way: way.saddle)),
            lines=tuple(self.lines),
            branches=branches,
            searched=tuple(searched),
            failed=(*dict.fromkeys(self.failed), *self.told_early_ends()),
            stopped=self.stopped,
        )
