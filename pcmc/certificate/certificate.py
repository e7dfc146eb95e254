"""The certificate of a surface: how near to equilibrium, how true to its curvatures, how stable.

``certify`` examines a surface alone. A solver's result adds what happened on the way (``Evidence``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import SurfaceError
from ..base.tolerances import AT_REST, COLLAPSED, NEAR_NEUTRAL, NEUTRAL
from ..base.units import NO_UNITS, Units
from ..forces.functional import energy
from ..forces.loose_parts import patch_residuals, rounding_left
from ..forces.volume_below import volumes_below
from ..meshing.quality import triangle_quality
from ..stability.equilibrium import Equilibrium, SecondVariation
from ..stability.factorisation import SingularMatrix
from ..stability.modes import Spectrum, count_soft, lowest
from ..surface import Plane, Surface, expect_surface, mirrored
from ..surface.supports import part_of_roof
from . import tables
from .balance import load_ratio, pressures_left_over
from .crossings import crossing_table, crossing_texts
from .forces import Forces, along_normal
from .proof import Attempt, Proof
from .supports import FORCE, MOMENT, balance_sentence, balance_table, boundary_view, pull_table, support_table
from .verdict import Evidence, Findings, Verdict, judge


@dataclass(frozen=True, eq=False)
class Certificate:
    """The findings about one surface. ``print`` shows them as a table.

    Attributes
    ----------
    verdict, detail : the verdict, and its reason (which mode, patch or place).
    residual : ‖Bᵀ∇E‖ over ``scale``: the forces left in the motion space, with the pull on pinched
        vertices beyond what their wall can take, and the relative differences of prescribed volumes (as
        squares). Of several loose parts, that of the worst.
    scale : norm of the single triangles' tension forces, force.
    energy : E, force·length.
    index : Morse index; None where the surface is not at rest. Rigid motions are not counted, nor motions
        that change a prescribed volume.
    eigenvalues : lowest second variations per unit area and displacement, force/length³, ascending.
    modes : (k,n,3) their displacement fields, unit mass.
    quality : smallest triangle quality outside walls that can pinch; ``walls_quality`` in these.
    acting : the forces of the supports by how they act; ``reactions`` are these (n,3) for each vertex.
    left : (n,3) the forces left in the motion space.
    pinched : (k,) vertices where a junction rests on Π and its wall has no height.
    proofs : why there is no equilibrium, if that is the verdict.
    tried : what a search for an equilibrium has tried, if that led to none.
    """

    verdict: Verdict
    detail: str
    residual: float
    scale: float
    energy: float
    index: int | None
    eigenvalues: Floats
    modes: Floats
    quality: float
    walls_quality: float
    acting: Forces = field(repr=False)
    left: Floats = field(repr=False)
    pinched: Ints
    proofs: tuple[Proof, ...] = ()
    tried: tuple[Attempt, ...] = ()
    FILED: ClassVar = (
        *("verdict", "detail", "residual", "scale", "energy", "volume", "index", "eigenvalues", "modes"),
        *("curvature_error", "quality", "walls_quality", "patches", "junctions", "load", "support"),
        *("pinched", "load_ratio", "proofs", "tried", "cables", "cable_ends", "rooms", "symmetric_in"),
        *("leaning", "crossings", "supports", "balance", "reactions", "mark"),
    )

    @cached_property
    def volumes(self) -> Floats:
        """(k,) the volume between each patch and Π (``volumes_below``), length³."""
        return volumes_below(self.acting.surface)

    @property
    def volume(self) -> float:
        """The volume between the roof and Π, length³; NaN where a periodic surface leaves Π."""
        return float(self.volumes[self.acting.surface.roof].sum())

    @cached_property
    def patches(self) -> pd.DataFrame:
        """A row per patch: tension, pressure (where there is snow, snow and net pressure), target curvature,
        area, errors by both definitions, quality."""
        return tables.patch_table(self.acting.surface, self.acting.standing)

    @property
    def curvature_error(self) -> float:
        """The largest |H - H̄|/H̄ by the variational definition, 0 if no patch has a pressure or a weight."""
        return _largest(self.patches["variational_max"])

    @cached_property
    def junctions(self) -> pd.DataFrame:
        """A row per curve: length, middle, forces left and Σ α n, force/length."""
        return tables.junction_table(self.acting.standing, self.left)

    @property
    def load(self) -> float:
        """The force of pressure and weight along Π's normal; with ``support`` what the mesh leaves."""
        return along_normal(self.acting.surface, self.acting.loads)

    @property
    def support(self) -> float:
        """The force of all supports along Π's normal."""
        return along_normal(self.acting.surface, self.acting.reactions)

    @cached_property
    def load_ratio(self) -> float:
        """Pressure and weight along Π's normal over the most that the supports could carry."""
        return load_ratio(self.acting.standing)

    @cached_property
    def cables(self) -> pd.DataFrame:
        """A row per part of a cable; see ``pcmc.certificate.tables.cable_table``."""
        return tables.cable_table(self.acting.standing, self.left)

    @cached_property
    def cable_ends(self) -> pd.DataFrame:
        """A row per end of a cable; see ``pcmc.certificate.tables.cable_end_table``."""
        return tables.cable_end_table(self.acting.standing, self.acting.cable_ends)

    @cached_property
    def rooms(self) -> pd.DataFrame:
        """A row per room of prescribed volume: the volume it has, the one prescribed, the difference over the
        latter, and the room's pressure."""
        return tables.room_table(self.acting.surface)

    @property
    def symmetric_in(self) -> tuple[str, ...]:
        """The mirror planes of the surface. Index, eigenvalues and verdict are about motions that are
        symmetric in these; ``certify(surface, whole=True)`` is about all."""
        return tuple(str(plane) for plane, _ in self.acting.surface.on_planes if plane.mirror)

    @property
    def part(self) -> str:
        """Which part of a roof with mirror planes this is; empty for a whole roof."""
        return part_of_roof(self.acting.surface)

    @cached_property
    def leaning(self) -> pd.DataFrame:
        """A row per wall: its largest angle from the vertical of Π, degrees, and the place."""
        return tables.lean_table(self.acting.standing)

    @cached_property
    def crossings(self) -> pd.DataFrame:
        """A row per two patches that cut each other, or one that cuts itself, as an equilibrium may; see
        ``pcmc.certificate.crossings.crossing_table``."""
        return crossing_table(self.acting.standing)

    @property
    def cuts_itself(self) -> str:
        """Where the surface cuts itself; empty where it does not."""
        return "; ".join(crossing_texts(self.crossings, self.acting.surface.size))

    @cached_property
    def supports(self) -> pd.DataFrame:
        """One row per support: a line, point, plane, mirror or end of a cable, with its length, middle,
        force, moment and largest force per length; see ``pcmc.certificate.supports.support_table``. Forces
        and moments add up to those of the loads, but for the ``balance``'s remainder."""
        return support_table(self.acting)

    @cached_property
    def pulls(self) -> pd.DataFrame:
        """One row per edge of these, with the force per length there and its direction."""
        return pull_table(self.acting)

    @cached_property
    def boundaries(self) -> pd.DataFrame:
        """The rows of ``supports`` as long as a curve: length, middle, reaction, largest one per length."""
        return boundary_view(self.supports)

    @cached_property
    def balance(self) -> pd.DataFrame:
        """Force and moment of the loads, of the supports, and what remains of both: a row each."""
        return balance_table(self.acting, self.supports)

    @property
    def remainder(self) -> tuple[Floats, Floats]:
        """Force (3,) and moment (3,) that loads and supports leave; see ``balance``."""
        left = self.balance.iloc[-1]
        return left[[*FORCE]].to_numpy(float), left[[*MOMENT]].to_numpy(float)

    @property
    def reactions(self) -> Floats:
        """(n,3) force of each support on the surface."""
        return self.acting.reactions

    @property
    def largest_reaction(self) -> float:
        """The largest force per length of a support, but for the pull across mirror planes; NaN without."""
        table = self.supports
        return float(table["per_length_max"][table["kind"] != "mirror"].max())

    @property
    def certified(self) -> bool:
        """At rest, and neither a saddle nor degenerate."""
        return self.verdict in (Verdict.STABLE, Verdict.NEUTRAL)

    @property
    def mark(self) -> str:
        """What each page, model and .ifc of the surface is marked with; empty for one that is in order."""
        if not self.certified:
            return f"NOT CERTIFIED: {self.verdict.value.split(':')[0]}"
        return "NOT TO BE BUILT: it cuts itself" if len(self.crossings) else ""

    def numbers(self) -> dict[str, Any]:
        """The scalar findings, for tables."""
        return {
            "verdict": self.verdict.name.lower(),
            "residual": self.residual,
            "energy": self.energy,
            "volume": self.volume,
            "index": self.index,
            "lowest_eigenvalue": float(self.eigenvalues[0]) if len(self.eigenvalues) else None,
            "curvature_error": self.curvature_error,
            "curvature_error_cotangent": _largest(self.patches["cotangent_max"]),
            "quality": self.quality,
            "walls_quality": self.walls_quality,
            "pinched": len(self.pinched),
            "load_ratio": self.load_ratio,
        }

    def text(self, units: Units = NO_UNITS) -> str:
        """The findings as a table, with the units of its numbers if they are given."""
        lowest, sums, force = self.eigenvalues, (self.load, self.support), units.behind("force")
        relative = self.patches["variational_max"].notna()  # of a sail without a load no error is
        rows = [
            ("verdict", self.verdict.value),
            ("", self.detail),
            ("units", units.sentence if units else ""),
            ("residual", f"{self.residual:.2e} of {self.scale:.4g}"),
            ("energy", f"{self.energy:.10g}{units.behind('energy')}{tables.cut_note(self.acting.surface)}"),
            ("volume", "" if math.isnan(self.volume) else f"{self.volume:.6g}{units.behind('volume')}"),
            ("Morse index", "-" if self.index is None else str(self.index)),
            ("of motions", "" if not self.symmetric_in else f"symmetric in {', '.join(self.symmetric_in)}"),
            ("lowest eigenvalue", f"{lowest[0]:.4g}{units.behind('eigenvalue')}" if len(lowest) else "-"),
            ("curvature error", f"{self.curvature_error:.2e}" if relative.any() else "-"),
            ("triangle quality", f"{self.quality:.3f} (sliding walls {self.walls_quality:.3f})"),
            ("pinched vertices", str(len(self.pinched))),
            ("walls lean", ", ".join(tables.lean_texts(self.leaning, self.acting.surface.size))),
            ("cuts itself", self.cuts_itself),
            ("load over capacity", f"{self.load_ratio:.3f}"),
            ("load, reactions", ", ".join(f"{x:.6g}{force}" for x in sums) + " along the plane's normal"),
            ("balance", balance_sentence(self.balance, self.symmetric_in)),
        ]
        head = "\n".join(f"{name:>20}  {text}" for name, text in rows if text)
        supports = self.supports.drop(columns=[*MOMENT])
        shown = self.patches, self.rooms, self.junctions, supports, self.cables, self.cable_ends
        texts = [tables.as_text(table, self.acting.surface.size) for table in shown if len(table)]
        return "\n\n".join([head, *texts])

    __repr__ = text


def certify(
    surface: Surface,
    *,
    modes: int = 1,
    tolerance: float = AT_REST,
    evidence: Evidence | None = None,
    tried: tuple[Attempt, ...] = (),
    whole: bool | Sequence[str | Plane] = False,
    clear: SecondVariation | None = None,
) -> Certificate:
    """Examine a surface.

    Parameters
    ----------
    surface : the surface; it is not changed.
    modes : how many of the lowest modes to compute; the index is counted in any case.
    tolerance : relative residual, > 0, up to which it counts as at rest.
    evidence, tried : what happened while it was solved, and what a search has tried: ``Result.certify``
        passes them on.
    whole : of a surface between mirror planes, examine ``mirrored`` of it, so that all motions count, not
        only those symmetric in these planes. True, or the planes to unfold at.

    Examples
    --------
    >>> from pcmc import Patch, Surface
    >>> corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    >>> roof = Surface(corners, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]], [0] * 4,
    ...                [Patch("roof", 1.0)], fixed=range(4))
    >>> certificate = certify(roof)
    >>> certificate.verdict.name, certificate.index, certificate.curvature_error < 1e-12
    ('STABLE', 0, True)
    """
    expect_surface(surface)
    validate.integer("modes", modes, most=surface.n)
    validate.number("tolerance", tolerance, above=0.0)
    if not isinstance(evidence, Evidence | None):
        validate.refuse("evidence", evidence, "an Evidence or None")
    if not isinstance(clear, SecondVariation | None):
        validate.refuse("clear", clear, "a SecondVariation or None")
    if whole is not False:
        surface = mirrored(surface, None if whole is True else whole)
    at = Equilibrium.of(surface)
    standing, pinchable, residual = at.shape, at.part.walls.pinchable, at.residual_with_pull
    qualities, in_wall = triangle_quality(at.X, standing.faces), pinchable[standing.patch_of_face]
    quality = float(qualities[~in_wall].min(initial=1.0))
    spectrum, eigenvalues, fields = Spectrum(), np.empty(0), np.empty((0, 0, 3))
    if residual <= tolerance and quality > COLLAPSED:
        spectrum, eigenvalues, fields = _stability(at, modes, clear)
    findings = Findings(
        surface=surface,
        pinchable=pinchable,
        residual=residual,
        tolerance=tolerance,
        quality=quality,
        spectrum=spectrum,
        own_residuals=patch_residuals(at.surface, at.classes, at.unbalanced),
        rounding=rounding_left(standing, at.classes, at.X),
        evidence=evidence,
        tried=tried,
        mode=fields[0] if len(fields) else np.empty((0, 3)),
        rigid=at.rigid.shape[1] if surface.rooms or surface.periodic else 0,
        pulled=tuple(np.flatnonzero(at.excess_pull).tolist()),
        left_over=pressures_left_over(standing),
    )
    verdict, detail = judge(findings)
    return Certificate(
        verdict=verdict,
        detail=detail,
        residual=residual,
        scale=at.scale,
        energy=at.energy,
        index=spectrum.index,
        eigenvalues=eigenvalues,
        modes=fields,
        quality=quality,
        walls_quality=float(qualities[in_wall].min(initial=1.0)),
        acting=Forces.of(surface, standing=standing),
        left=at.unbalanced,
        pinched=np.flatnonzero(at.part.resting),
        proofs=findings.proofs if verdict is Verdict.NO_EQUILIBRIUM else (),
        tried=tried,
    )


def certified(surface: Surface, anyway: bool, known: Certificate | None = None) -> Certificate:
    """The certificate of a surface that something is to be built after; computed where it is not ``known``.

    SurfaceError if the surface is not certified, unless ``anyway``, and if ``known`` is another surface's.
    """
    validate.flag("anyway", anyway)
    if not isinstance(known, Certificate | None):
        validate.refuse("certificate", known, "a Certificate, as of certify")
    if known is not None:
        own = energy(surface)
        if len(known.reactions) != surface.n or not math.isclose(known.energy, own, rel_tol=1e-9):
            text = "certificate: belongs to another surface; pass certify(surface), or leave it out"
            raise SurfaceError(text, what="certificate", found=known.energy, expected=own)
    certificate = certify(surface) if known is None else known
    require_certified(certificate, anyway)
    return certificate


def require_certified(certificate: Certificate, anyway: bool) -> None:
    """SurfaceError for the certificate of a surface that is not certified, unless ``anyway``."""
    if not (certificate.certified or validate.flag("anyway", anyway)):
        verdict = certificate.verdict
        text = f"surface: not certified ({verdict.value}); solve it first, or accept it with"
        text += " anyway=True (--allow-uncertified)"
        raise SurfaceError(text, what="surface", found=verdict, expected="a certified surface")


def _stability(
    equilibrium: Equilibrium, modes: int, clear: SecondVariation | None
) -> tuple[Spectrum, Floats, Floats]:
    """What the eigenvalues are like by their counts, and the lowest of them with their modes (k,n,3)."""
    square = equilibrium.shape.size**2
    clear = clear if clear is not None and clear.of.same_as(equilibrium) else None
    spectrum, system = count_soft(equilibrium, NEUTRAL / square, NEAR_NEUTRAL / square, clear)
    if system is not None and modes > 0:
        try:
            return spectrum, *lowest(system, modes)
        except SingularMatrix as error:
            spectrum = replace(spectrum, hidden=f"{error}; modes=0 judges by counts alone")
    return spectrum, np.empty(0), np.empty((0, 0, 3))


def _largest(values: pd.Series) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else 0.0
