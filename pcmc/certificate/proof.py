"""Proofs that a surface has no equilibrium, and what a search has tried. ``str`` gives the sentence.

A proof is a theorem about every smooth surface of these supports, tensions and loads. A mesh may come to rest
where no smooth surface does, as its triangles balance along their normals alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Overload:
    """Vertical balance of the whole: the load exceeds what tension at the boundary can carry.

    Both are those of every smooth surface with these supports: see ``balance.load_is_given``.

    >>> print(Overload(1.2))
    the pressure is 1.20 times what the boundary's tension could carry on any smooth surface
    """

    ratio: float  # load over capacity, above 1; see ``pcmc.certificate.balance.load_ratio``
    load: str = "pressure"  # what it is called: under snow "net pressure"

    def __str__(self) -> str:
        digits = ".3f" if self.ratio < 1.1 else ".2f" if self.ratio < 1e4 else ".3g"
        times = f"{self.ratio:{digits}} times"
        return f"the {self.load} is {times} what the boundary's tension could carry on any smooth surface"


@dataclass(frozen=True)
class UnbalancedJunction:
    """Tensions at a junction that cannot balance at any angles, Eq. (7).

    >>> print(UnbalancedJunction(("left", "right", "wall"), 5.0, (1.0, 3.0)))
    the tensions at the junction left | right | wall cannot balance: 5 > 1 + 3
    >>> UnbalancedJunction(("left", "right", "wall"), 5.0, (1.0, 3.0), ("wall", 2.3, True)).hint
    "; try a tension of 2.3 for 'wall' (in a plan, wall = 2.3)"
    """

    junction: tuple[str, ...]  # names of the patches that meet there
    strongest: float  # the largest tension, and those of the other patches, force/length
    others: tuple[float, ...]
    remedy: tuple[str, float, bool] | None = None  # a patch, the tension for balance, whether a wall

    def __str__(self) -> str:
        return f"{self.imbalance}{self.hint}"

    @property
    def imbalance(self) -> str:
        """The sentence without the remedy."""
        return self.told("cannot balance", ">")

    def told(self, how: str, beside: str) -> str:
        """How the tensions are, and what they are."""
        names, others = " | ".join(self.junction), " + ".join(f"{tension:g}" for tension in self.others)
        return f"the tensions at the junction {names} {how}: {self.strongest:g} {beside} {others}"

    @property
    def hint(self) -> str:
        """The remedy in words, after a semicolon; empty if there is none."""
        if self.remedy is None:
            return ""
        name, tension, wall = self.remedy
        key = f" (in a plan, wall = {tension:g})" if wall else ""
        return f"; try a tension of {tension:g} for {name!r}{key}"


@dataclass(frozen=True)
class WeakCable:
    """A cable that is too weak for the free edge of a flat sail; see ``pcmc.certificate.cables.weak_cable``.

    >>> print(WeakCable("east", 1.0, 2.0**0.5, 2.0, 0.5 * math.pi))
    cable 'east' is too weak for a flat sail: 1 < α L / (2 sin(φ/2)) = 1.414, L = 2, φ = 90°; raise it
    """

    cable: str
    tension: float  # force
    least: float  # the least tension at which it could be at rest
    chord: float  # L, distance of its ends
    angle: float  # φ, the most that its arc can turn by, radians

    def __str__(self) -> str:
        text = f"cable {self.cable!r} is too weak for a flat sail: {self.tension:.4g} < α L / (2 sin(φ/2)) ="
        angle = math.degrees(self.angle)
        return f"{text} {self.least:.4g}, L = {self.chord:.4g}, φ = {angle:.3g}°; raise it"


@dataclass(frozen=True)
class Unheld:
    """A part that no support holds: without pressure it shrinks, with a weight it falls.

    Without pressure its homotheties about Π's point have E(s) = s T, or s² T and cables s C, all of which
    grow with s. Of a part on no support E(X + t n) = E(X) + t Σ w A, where the pressures cancel.

    >>> print(Unheld(vertex=7, falls=True))
    nothing holds the part of the surface around vertex 7, and it has a weight: it falls
    """

    vertex: int  # one of its vertices
    falls: bool = False  # otherwise it shrinks

    def __str__(self) -> str:
        falls, shrinks = "and it has a weight: it falls", "which has no pressure: it shrinks to nothing"
        part = f"the part of the surface around vertex {self.vertex}"
        return f"nothing holds {part}, {falls if self.falls else shrinks}"


Proof = Overload | UnbalancedJunction | Unheld | WeakCable

STARTS = {
    "given start": "from the given start",
    "low start": "from a low start",
    "stationary point": "sought as any stationary point",
}
ENDINGS = {
    "diverged": "the surface grows without bound",
    "vanished": "the surface shrinks to nothing",
    "degenerate": "triangles collapse",
    "stalled": "no step helps any more",
    "iteration_limit": "the limit of iterations is reached",
    "non_finite": "a number is not finite",
    "saddle": "the way leads to a saddle",
    "lost": "the branch of equilibria cannot be followed beyond {at}",
    "no start": "no equilibrium is found to begin with",
    "fold": "the branch of equilibria folds at {at}",
}


@dataclass(frozen=True)
class Attempt:
    """What a search for an equilibrium has tried, and how that ended. It proves nothing about other shapes.

    Attributes
    ----------
    way : ``"given start"``, ``"low start"``, ``"stationary point"``; or what grows along a branch of
        equilibria: ``"pressure"``, ``"net pressure"``, ``"weight"``, ``"load"`` (pressure and weight), of all
        patches in proportion; ``"distance"`` of the held curves; ``"tensions"``, the share of the way from
        equal tensions of the patches under pressure.
    end : a key of ``ENDINGS``; the solver's status where it failed.
    value : what grows, at the end of the branch; 1 is what the surface asks for. None without a branch.
    start : where the branch begins.
    tensions : names and tensions at the end, where these vary.

    >>> print(Attempt("pressure", "fold", 0.8, 0.4))  # doctest: +ELLIPSIS
    the branch of equilibria folds at 0.800 of the pressure (followed from 0.4 of it): lower all ...
    >>> Attempt("weight", "fold", 0.7868, 0.4).remedy
    'lower all weights below 0.786 of theirs, or raise all tensions above 1.271 times theirs'
    >>> print(Attempt("given start", "diverged"))
    from the given start the surface grows without bound
    """

    way: str
    end: str
    value: float | None = None
    start: float | None = None
    tensions: tuple[tuple[str, float], ...] = ()

    @property
    def folds(self) -> bool:
        """Whether a branch of equilibria has turned back."""
        return self.end == "fold"

    def __str__(self) -> str:
        if self.way in STARTS:
            return f"{STARTS[self.way]} {ENDINGS[self.end]}"
        if self.value is None:
            along = {"distance": "moved apart", "tensions": "from equal tensions"}
            return f"{along.get(self.way, f'raising the {self.way}')}: {ENDINGS[self.end]}"
        name = "distance between the held curves" if self.way == "distance" else self.way
        at = f"{_three(self.value)} of the {name} (followed from {self.start:.3g} of it)"
        if self.way == "tensions":
            reached = ", ".join(f"{patch} {tension:.4g}" for patch, tension in self.tensions)
            at = f"{reached}, {_three(self.value)} of the way from equal tensions"
        return ENDINGS[self.end].format(at=at) + (f": {self.remedy}" if self.folds else "")

    @property
    def remedy(self) -> str:
        """What brings a surface to where the branch still is."""
        if self.way == "distance":
            return "bring the held curves nearer to each other"
        value = self.value or 0.0
        if self.way == "tensions" or not value:
            return "stay on that side of it"
        loads = "pressures and weights" if self.way == "load" else f"{self.way}s"
        below, above = _three(value, math.floor), _three(1.0 / value, math.ceil)
        return f"lower all {loads} below {below} of theirs, or raise all tensions above {above} times theirs"


def _three(value: float, rounding: Callable[[float], float] = round) -> str:
    """Three digits behind the point, or three in all for small and large numbers."""
    fixed = 1e-2 <= value < 1e4
    step = 10.0 ** (-3 if fixed else math.floor(math.log10(value or 1.0)) - 2)
    rounded = step * rounding(value / step)
    return f"{rounded:.3f}" if fixed else f"{rounded:.3g}"
