"""What a project leads to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..base.units import NO_UNITS, Units
from ..certificate.certificate import Certificate
from ..solvers.result import Result
from ..surface import Surface

if TYPE_CHECKING:
    from ..accuracy import AccurateResult, MeshCheck
    from ..design import Design


class Whole(NamedTuple):
    """The whole roof with its certificate, which counts motions that are not symmetric, too."""

    surface: Surface
    certificate: Certificate


@dataclass(frozen=True, eq=False)
class Outcome:
    """The designed roof of a project: solved, its targets met, remeshed.

    Attributes
    ----------
    result : of the last solve; ``surface`` and ``certificate`` are its.
    files : the files written.
    design : the search for the targets; None without targets.
    mesh_check : the surface on finer meshes; None where the project asks for none.
    accurate : the search for an accuracy; None where the project asks for none.
    units : those of the project, in which all numbers are.
    whole : the whole roof, if the project asks for it: ``surface`` is the part between its mirror planes.
    cached : whether the roof was solved before and comes from the cache. Then ``accurate`` is None, and the
        histories of ``result`` and ``design`` are empty.
    notes : what was chosen where the project does not say it, and what happened on the way.
    advice : where the roof is not good, what to type, a line each; empty if no remedy is known.
    """

    result: Result
    files: Sequence[Path]
    design: Design | None = None
    mesh_check: MeshCheck | None = None
    accurate: AccurateResult | None = None
    units: Units = NO_UNITS
    cached: bool = False
    whole: Whole | None = None
    notes: Sequence[str] = ()
    advice: Sequence[str] = ()

    def __repr__(self) -> str:
        """The verdict, what the targets reached, what was written, and the advice, above the surface."""
        certificate = self.shown.certificate
        lines = [certificate.verdict.value]
        if not certificate.certified and certificate.detail:
            lines.append(certificate.detail)
        if self.design is not None:
            lines.append(f"targets {self.design.text(self.units)}")
        if self.files:
            lines.append(f"written: {', '.join(map(str, self.files))}")
        if self.advice:
            lines.append("\n  ".join(self.advice))
        if self.units:
            lines.append(self.units.sentence)
        return "\n".join([*lines, repr(self.shown.surface)])

    @property
    def surface(self) -> Surface:
        """The surface reached."""
        return self.result.surface

    @property
    def certificate(self) -> Certificate:
        """The certificate of the surface reached."""
        return self.result.certificate

    @property
    def shown(self) -> Whole:
        """What is written and drawn: the whole roof if the project asks for it, with its certificate."""
        return Whole(self.surface, self.certificate) if self.whole is None else self.whole

    @property
    def good(self) -> bool:
        """Whether the surface is certified, every target is met, and every accuracy reached."""
        if self.cached:
            return True  # no other roof is kept
        met = self.design is None or self.design.met
        certified = self.certificate.certified and (self.whole is None or self.whole.certificate.certified)
        return certified and met and (self.accurate is None or self.accurate.reached)
