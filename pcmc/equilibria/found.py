"""What a search for equilibria returns: the equilibria, the branches, and the barriers between minima."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import pandas as pd

from ..accuracy import MeshCheck
from ..base import validate
from ..base.units import NO_UNITS, Units
from ..certificate import Certificate
from ..forces.rooms import energy_at_volumes
from ..forces.volume_below import volume_below
from ..solvers.continuation import Branch
from ..surface import Surface
from .branches import TracedParameter

INCOMPLETE = (
    "No search of this kind proves that there is no further equilibrium: one that no branch in the span"
    " reaches, and no start comes near, is missed. A barrier is the lowest of the saddles found, so an upper"
    " bound; a lower pass cannot be excluded."
)


@dataclass(frozen=True, eq=False)
class FoundEquilibrium:
    """An equilibrium, its certificate, and how it was found.

    ``energy`` is E where pressures are given. Where rooms prescribe volumes it is E + Σ p V, the energy at
    these volumes, so that different pressures can be compared. ``mesh_check`` is there if it was asked for.
    """

    surface: Surface = field(repr=False)
    certificate: Certificate = field(repr=False)
    found: str
    mesh_check: MeshCheck | None = field(default=None, repr=False)

    @property
    def index(self) -> int:
        """The Morse index; -1 where rounding hides it."""
        return -1 if self.certificate.index is None else self.certificate.index

    @cached_property
    def energy(self) -> float:
        return energy_at_volumes(self.surface)

    @property
    def height(self) -> float:
        """Of the highest vertex over Π, length."""
        return float(self.surface.plane.height(self.surface.vertices).max())


@dataclass(frozen=True)
class WayDown:
    """A way down from a saddle of index 1: to the minimum of this number, or none, with the reason."""

    saddle: int
    to: int | None
    end: str = ""
    lost: bool = False  # whether the solver gave it up, so that its end is not known


def pairs(ways: Sequence[WayDown]) -> Iterator[tuple[WayDown, WayDown]]:
    """The two ways down from each saddle, which follow each other."""
    return zip(ways[::2], ways[1::2], strict=True)


@dataclass(frozen=True)
class Barrier:
    """The energy that leads from a minimum over a saddle, and where that leads."""

    start: int
    saddle: int
    to: int | None  # None where the way down ends at no minimum
    energy: float  # E of the saddle less that of the minimum, force·length
    end: str = ""
    lost: bool = False  # whether the solver gave that way up


@dataclass(frozen=True, eq=False)
class Equilibria:
    """The equilibria of one surface that a search has found. ``print`` shows them; ``pcmc.plot`` draws them.

    Attributes
    ----------
    found : the equilibria by energy, the lowest first; numbers count from 1.
    ways : the ways down from each saddle of index 1.
    lines, branches : the parameters that were followed, and for each the branches in it.
    searched, failed : sentences: what was tried, and what did not work out, or only as the mesh is coarse.
    stopped : whether the search was stopped before its end.
    """

    found: tuple[FoundEquilibrium, ...]
    ways: tuple[WayDown, ...]
    lines: tuple[TracedParameter, ...]
    branches: Mapping[str, tuple[Branch, ...]] = field(repr=False)
    searched: tuple[str, ...] = ()
    failed: tuple[str, ...] = ()
    stopped: bool = False

    def __len__(self) -> int:
        return len(self.found)

    @cached_property
    def surfaces(self) -> tuple[Surface, ...]:
        """All that can be shown: the equilibria by number, then the points of the branches in turn."""
        branches = (branch for line in self.lines for branch in self.branches[line.name])
        on_branches = (branch.surfaces[row] for branch in branches for row in sorted(branch.surfaces))
        return (*(one.surface for one in self.found), *on_branches)

    def __getitem__(self, number: int) -> FoundEquilibrium:
        """The equilibrium of a number, from 1."""
        validate.integer("number", number, least=1, most=len(self.found))
        return self.found[number - 1]

    @property
    def stable(self) -> tuple[int, ...]:
        """The numbers of the minima."""
        return tuple(k for k, one in enumerate(self.found, 1) if one.index == 0)

    @property
    def table(self) -> pd.DataFrame:
        """A row per equilibrium: number, index, energy, height, volume, eigenvalue, verdict, mesh, found."""
        rows = []
        for k, one in enumerate(self.found, 1):
            values = one.index, one.energy, one.height, volume_below(one.surface)
            eigenvalue, verdict = float(one.certificate.eigenvalues[0]), one.certificate.verdict.name.lower()
            mesh = "" if one.mesh_check is None else one.mesh_check.verdict.name.lower()
            rows.append([k, *values, eigenvalue, verdict, mesh, one.found])
        head = ["number", "index", "energy", "height", "volume", "lowest_eigenvalue"]
        return pd.DataFrame(rows, columns=[*head, "verdict", "mesh", "found"])

    @property
    def barriers(self) -> tuple[Barrier, ...]:
        """From each minimum the saddles that a way down joins to it, lowest first, and their other side."""
        rows = []
        for one, other in pairs(self.ways):
            for here, there in ((one, other), (other, one)):
                if here.to is not None:
                    height = self[here.saddle].energy - self[here.to].energy
                    rows.append(Barrier(here.to, here.saddle, there.to, height, there.end, there.lost))
        return tuple(sorted(rows, key=lambda row: (row.start, row.energy)))

    def barrier(self, start: int, to: int | None = None) -> float:
        """The least energy, of the ways found, that leads from a minimum to another; or out of it at all.

        Over all chains of minima and saddles from ``start`` to ``to`` the least of their highest saddles,
        less the energy of the start; inf if no chain found leads there.
        """
        validate.choice("start", str(validate.integer("start", start)), [str(k) for k in self.stable])
        if to is None:
            out = (b.energy for b in self.barriers if b.start == start and b.to != start and not b.lost)
            return min(out, default=math.inf)
        validate.choice("to", str(validate.integer("to", to)), [str(k) for k in self.stable])
        reached, top = set[int | None]({start}), -math.inf
        while to not in reached:
            steps = [(self[b.saddle].energy, b.to) for b in self.barriers if b.start in reached and b.to]
            steps = [step for step in steps if step[1] not in reached]
            if not steps:
                return math.inf
            energy, end = min(steps)
            reached, top = {*reached, end}, max(top, energy)
        return max(0.0, top - self[start].energy) if to != start else 0.0

    def text(self, units: Units = NO_UNITS) -> str:
        """The table, the barriers, what was searched, and what that leaves open."""
        shown = self.table.drop(columns=["mesh"] * (not any(one.mesh_check for one in self.found)))
        numbers = shown.select_dtypes(float).columns
        table = shown.assign(**{name: shown[name].map("{:.6g}".format) for name in numbers})
        table = table.rename(columns=lambda name: name.replace("_", " "))
        rows = table.to_string(index=False) if self.found else "No equilibrium was found."
        half = ", ".join(self.found[0].certificate.symmetric_in) if self.found else ""
        if half:
            half = f"All this is of a part of the roof; shapes that are not symmetric in {half} were left out"
            half += " (--whole, or the surface that pcmc.mirrored unfolds, has them)."
        stopped = "The search was stopped before its end." * self.stopped
        words = [*self.barrier_lines(units), *self.searched, *self.failed, stopped, half, INCOMPLETE]
        return "\n".join(line for line in (units.sentence if units else "", rows, *words) if line)

    __repr__ = text

    def barrier_lines(self, units: Units = NO_UNITS) -> list[str]:
        """A line for each barrier: from where, over which saddle, to where, its energy; last the unknown."""
        lines = list[str]()
        for b in self.barriers:
            end = b.end if b.to is None else f"to {b.to}"
            energy = f"{b.energy:.6g}{units.behind('energy')}"
            lines.append(f"barrier from {b.start} over saddle {b.saddle} {end}: {energy}")
        joined = list[list[int]]()
        for k in self.stable:
            group = next((group for group in joined if self.barrier(group[0], k) < math.inf), None)
            joined.append([k]) if group is None else group.append(k)
        for group in joined[1:]:
            ends = f"from {joined[0][0]} to {', '.join(map(str, group))}"
            lines.append(f"barrier {ends}: not known, as no saddle was found between them")
        return lines
