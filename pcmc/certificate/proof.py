"""Proofs that a surface has no equilibrium: what was found, with its numbers. ``str`` gives the sentence."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Overload:
    """Vertical balance of the whole: the load exceeds what tension at the boundary can carry.

    Attributes
    ----------
    ratio : load over capacity, above 1; see ``pcmc.certificate.balance.load_ratio``.
    load : what it is called, ``"pressure"`` or, under snow, ``"net pressure"``.

    >>> print(Overload(1.2))
    the pressure is 1.20 times what the boundary's tension could carry
    """

    ratio: float
    load: str = "pressure"

    def __str__(self) -> str:
        digits = ".3f" if self.ratio < 1.1 else ".2f" if self.ratio < 1e4 else ".3g"
        return f"the {self.load} is {self.ratio:{digits}} times what the boundary's tension could carry"


@dataclass(frozen=True)
class UnbalancedJunction:
    """Tensions at a junction that cannot balance at any angles, Eq. (7).

    Attributes
    ----------
    junction : names of the patches that meet there.
    strongest, others : the largest tension, and those of the other patches, force/length.
    remedy : a patch, a tension of it with which they balance, force/length, and whether it is a wall.

    >>> print(UnbalancedJunction(("left", "right", "wall"), 5.0, (1.0, 3.0)))
    the tensions at the junction left | right | wall cannot balance: 5 > 1 + 3
    >>> UnbalancedJunction(("left", "right", "wall"), 5.0, (1.0, 3.0), ("wall", 2.3, True)).hint
    "; try a tension of 2.3 for 'wall' (in a plan, wall = 2.3)"
    """

    junction: tuple[str, ...]
    strongest: float
    others: tuple[float, ...]
    remedy: tuple[str, float, bool] | None = None

    def __str__(self) -> str:
        return f"{self.imbalance}{self.hint}"

    @property
    def imbalance(self) -> str:
        """The sentence without the remedy."""
        others = " + ".join(f"{tension:g}" for tension in self.others)
        names = " | ".join(self.junction)
        return f"the tensions at the junction {names} cannot balance: {self.strongest:g} > {others}"

    @property
    def hint(self) -> str:
        """The remedy in words, after a semicolon; empty if there is none."""
        if self.remedy is None:
            return ""
        name, tension, wall = self.remedy
        key = f" (in a plan, wall = {tension:g})" if wall else ""
        return f"; try a tension of {tension:g} for {name!r}{key}"


@dataclass(frozen=True)
class Fold:
    """A fold on the way from an equilibrium: a branch of equilibria that turns back before it arrives.

    Attributes
    ----------
    parameter : what grows along the branch: ``"pressure"``, all pressures in proportion, or
        ``"net pressure"``, that less the snow; ``"distance"``, that of the held curves from each other;
        ``"tensions"``, the share of the way from equal tensions of the patches under pressure.
    value : the parameter at the fold; 1 is what the surface asks for.
    start : the parameter where the branch starts.
    tensions : names and tensions at the fold, where these vary.

    >>> print(Fold("pressure", 0.8, 0.4))  # doctest: +ELLIPSIS
    the equilibria end at a fold at 0.800 of the pressure (followed from 0.4 of it): lower all ...
    >>> print(Fold("distance", 0.95, 0.5))  # doctest: +ELLIPSIS
    the film ends at a fold at 0.950 of the distance between the held curves (followed from 0.5 ...
    """

    parameter: str
    value: float
    start: float
    tensions: tuple[tuple[str, float], ...] = ()

    def __str__(self) -> str:
        if self.parameter == "tensions":
            at = ", ".join(f"{name} {tension:.4g}" for name, tension in self.tensions)
            return (
                f"from equal tensions the equilibria end at a fold at {at}, {_three(self.value)} of the way:"
                " stay on that side of it"
            )
        value, start = _three(self.value), f"{self.start:.3g}"
        if self.parameter == "distance":
            return (
                f"the film ends at a fold at {value} of the distance between the held curves (followed from"
                f" {start} of it): bring them nearer to each other"
            )
        return (
            f"the equilibria end at a fold at {value} of the {self.parameter} (followed from {start} of it):"
            f" lower all {self.parameter}s below {value} of theirs, or raise all tensions above"
            f" {_three(1.0 / self.value)} times theirs"
        )


@dataclass(frozen=True)
class Unheld:
    """A part that no vertex fixes has no stable equilibrium, and none at all without pressure.

    Its homotheties about Π's point are free, so that E(s) = s² T - s³ P with T = Σ α A and P = Σ p V.
    At rest 2 T = 3 P, and there E'' = -2 T < 0.

    Attributes
    ----------
    vertex : one of its vertices.
    pressed : whether any of its patches is under pressure.
    """

    vertex: int
    pressed: bool

    def __str__(self) -> str:
        part = f"nothing fixes the part of the surface around vertex {self.vertex}"
        if self.pressed:
            return f"{part}: from every equilibrium it grows or shrinks to nothing, so that none is stable"
        return f"{part}, which has no pressure: it shrinks to nothing"


Proof = Overload | UnbalancedJunction | Fold | Unheld


def _three(value: float) -> str:
    """Three digits behind the point, or three in all for small and large numbers."""
    return f"{value:.3f}" if 1e-2 <= value < 1e4 else f"{value:.3g}"
