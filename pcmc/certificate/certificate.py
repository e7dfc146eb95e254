"""The certificate of a surface: how near to equilibrium, how true to its curvatures, how stable.

``certify`` examines a surface alone. A solver's result adds what happened on the way (``Evidence``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.errors import SurfaceError
from ..base.units import NO_UNITS, Units
from ..forces.functional import energy, patch_areas
from ..forces.loose_parts import islands, ratios, rounding_left, squared_forces
from ..forces.volume_below import volume_below
from ..meshing.quality import triangle_quality
from ..stability.equilibrium import Equilibrium, SecondVariation
from ..stability.factorisation import SingularMatrix
from ..stability.modes import NEAR, NEUTRAL, Spectrum, count_soft, lowest
from ..surface import Plane, Surface, expect_surface, mirrored
from ..surface.topology import SHEET
from .balance import FORCE, MOMENT, balance_sentence, balance_table, load, load_ratio, pressures_left_over
from .cables import cable_end_table, cable_table
from .proof import Attempt, Proof
from .reactions import SupportForces, support_forces
from .supports import boundary_view, pull_table, support_table
from .tables import junction_table, lean_table, lean_texts, patch_table, room_table
from .verdict import COLLAPSED, Evidence, Findings, Verdict, judge, only_coarse

TOLERANCE = 1e-8  # relative residual up to which a surface counts as at rest


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
    energy, volume : E (force·length) and the volume between the roof and Π (``volumes_below``, length³).
    index : Morse index; None where the surface is not at rest. Rigid motions are not counted, nor motions
        that change a prescribed volume.
    eigenvalues : lowest second variations per unit area and displacement, force/length³, ascending.
    modes : (k,n,3) their displacement fields, unit mass.
    curvature_error : largest |H - H̄|/H̄ by the variational definition.
    quality : smallest triangle quality outside walls that can pinch; ``walls_quality`` in these.
    patches : a row per patch: tension, pressure (where there is snow, snow and net pressure), target
        curvature, area, errors by both definitions, quality.
    junctions : a row per curve: length, middle, forces left and Σ α n, force/length.
    load, support : forces along Π's normal, of pressure and weight and of all supports; their sum is
        what the mesh leaves along the sheets.
    acting : the forces of the supports by how they act; ``reactions`` are these (n,3) for each vertex.
    pinched : (k,) vertices where a junction rests on Π and its wall has no height.
    load_ratio : pressure and weight along Π's normal over the most that the supports could carry.
    proofs : why there is no equilibrium, if that is the verdict.
    tried : what a search for an equilibrium has tried, if that led to none.
    cables, cable_ends : see ``pcmc.certificate.cables.cable_table`` and ``cable_end_table``.
    rooms : a row per room of prescribed volume: the volume it has, the one prescribed, the difference
        over the latter, and the room's pressure.
    symmetric_in : the mirror planes of the surface. Index, eigenvalues and verdict are about motions that are
        symmetric in these; ``certify(surface, whole=True)`` is about all.
    leaning : a row per wall: its largest angle from the vertical of Π, degrees, and the place.
    """

    verdict: Verdict
    detail: str
    residual: float
    scale: float
    energy: float
    volume: float
    index: int | None
    eigenvalues: Floats
    modes: Floats
    curvature_error: float
    quality: float
    walls_quality: float
    patches: pd.DataFrame
    junctions: pd.DataFrame
    load: float
    support: float
    acting: SupportForces = field(repr=False)  # no file has it: it holds the surface
    pinched: Ints
    load_ratio: float
    proofs: tuple[Proof, ...] = ()
    tried: tuple[Attempt, ...] = ()
    cables: pd.DataFrame = field(default_factory=pd.DataFrame)
    cable_ends: pd.DataFrame = field(default_factory=pd.DataFrame)
    rooms: pd.DataFrame = field(default_factory=pd.DataFrame)
    symmetric_in: tuple[str, ...] = ()
    leaning: pd.DataFrame = field(default_factory=pd.DataFrame)

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
        return balance_table(self.acting.standing, self.supports)

    @property
    def remainder(self) -> tuple[Floats, Floats]:
        """Force (3,) and moment (3,) that loads and supports leave; see ``balance``."""
        left = self.balance.iloc[-1]
        return left[[*FORCE]].to_numpy(float), left[[*MOMENT]].to_numpy(float)

    @property
    def reactions(self) -> Floats:
        """(n,3) force of each support on the surface."""
        return self.acting.forces

    @property
    def largest_reaction(self) -> float:
        """The largest force per length of a support, but for the pull across mirror planes; NaN without."""
        table = self.supports
        return float(table["per_length_max"][table["kind"] != "mirror"].max())

    @property
    def certified(self) -> bool:
        """At rest, and neither a saddle nor degenerate."""
        return self.verdict in (Verdict.STABLE, Verdict.NEUTRAL)

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

    def __str__(self) -> str:
        return self.text()

    __repr__ = __str__  # what a prompt shows: the findings, not arrays

    def text(self, units: Units = NO_UNITS) -> str:
        """The findings as a table, with the units of its numbers if they are given."""
        lowest, sums, force = self.eigenvalues, (self.load, self.support), units.behind("force")
        rows = [
            ("verdict", self.verdict.value),
            ("", self.detail),
            ("units", units.sentence if units else ""),
            ("residual", f"{self.residual:.2e} of {self.scale:.4g}"),
            ("energy", f"{self.energy:.10g}{units.behind('energy')}"),
            ("volume", f"{self.volume:.6g}{units.behind('volume')}"),
            ("Morse index", "-" if self.index is None else str(self.index)),
            ("of motions", "" if not self.symmetric_in else f"symmetric in {', '.join(self.symmetric_in)}"),
            ("lowest eigenvalue", f"{lowest[0]:.4g}{units.behind('eigenvalue')}" if len(lowest) else "-"),
            ("curvature error", f"{self.curvature_error:.2e}"),
            ("triangle quality", f"{self.quality:.3f} (sliding walls {self.walls_quality:.3f})"),
            ("pinched vertices", str(len(self.pinched))),
            ("walls lean", ", ".join(lean_texts(self.leaning))),
            ("load over capacity", f"{self.load_ratio:.3f}"),
            ("load, reactions", ", ".join(f"{x:.6g}{force}" for x in sums) + " along the plane's normal"),
            ("balance", balance_sentence(self.balance, self.symmetric_in)),
        ]
        head = "\n".join(f"{name:>20}  {text}" for name, text in rows if text)
        supports = self.supports.drop(columns=[*MOMENT])
        tables = self.patches, self.rooms, self.junctions, supports, self.cables, self.cable_ends
        shown = [t.to_string(index=False, float_format=lambda x: f"{x:.4g}") for t in tables if len(t)]
        return "\n\n".join([head, *shown])


def certify(
    surface: Surface,
    *,
    modes: int = 1,
    tolerance: float = TOLERANCE,
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
    if whole is not False:
        surface = mirrored(surface, None if whole is True else whole)
    equilibrium = Equilibrium.of(surface)
    part, left, residual = equilibrium.part, equilibrium.unbalanced, equilibrium.residual_with_pull
    standing, X, pinchable = part.surface, part.surface.vertices, part.walls.pinchable
    qualities = triangle_quality(X, standing.faces)
    in_wall = pinchable[standing.patch_of_face]
    quality = float(qualities[~in_wall].min(initial=1.0))
    at_rest = residual <= tolerance and quality > COLLAPSED
    spectrum, eigenvalues, fields = Spectrum(), np.empty(0), np.empty((0, 0, 3))
    if at_rest:
        spectrum, eigenvalues, fields = _stability(equilibrium, modes, clear)
    findings = Findings(
        surface=surface,
        pinchable=pinchable,
        residual=residual,
        tolerance=tolerance,
        quality=quality,
        spectrum=spectrum,
        own_residuals=_own_residuals(equilibrium),
        rounding=rounding_left(standing, part.classes, X),
        evidence=evidence,
        tried=tried,
        mode=fields[0] if len(fields) else np.empty((0, 3)),
        rigid=equilibrium.rigid.shape[1] if surface.rooms else 0,
    )
    verdict, reason = judge(findings)
    pulled = np.flatnonzero(equilibrium.excess_pull)
    notes = (
        only_coarse(surface, pinchable) if at_rest and surface.tensions.any() else "",
        f"at {len(pulled)} pinched vertices, the first {pulled[0]}, the sheets pull harder than the"
        " wall can hold: the wall will stand there once solved"
        if len(pulled)
        else "",
        pressures_left_over(standing),
    )
    patches = patch_table(surface, standing, patch_areas(surface), qualities)
    errors, acting = patches["variational_max"], support_forces(surface, standing=standing)
    return Certificate(
        verdict=verdict,
        detail="; ".join(filter(None, (reason, *notes))),
        residual=residual,
        scale=equilibrium.scale,
        energy=equilibrium.energy,
        volume=volume_below(surface),
        index=spectrum.index,
        eigenvalues=eigenvalues,
        modes=fields,
        curvature_error=_largest(errors),
        quality=quality,
        walls_quality=float(qualities[in_wall].min(initial=1.0)),
        patches=patches,
        junctions=junction_table(standing, left),
        load=load(standing),
        support=float((acting.forces @ np.array(surface.plane.normal)).sum()),
        acting=acting,
        pinched=np.flatnonzero(part.resting),
        load_ratio=load_ratio(standing),
        proofs=findings.proofs if verdict is Verdict.NO_EQUILIBRIUM else (),
        tried=tried,
        cables=cable_table(standing, left),
        cable_ends=cable_end_table(standing),
        rooms=room_table(surface),
        leaning=lean_table(standing),
        symmetric_in=tuple(str(plane) for plane, _ in surface.on_planes if plane.mirror),
    )


def certified(surface: Surface, anyway: bool, known: Certificate | None = None) -> Certificate:
    """The certificate of a surface that something is to be built after; computed where it is not ``known``.

    SurfaceError if the surface is not certified, unless ``anyway``, and if ``known`` is another surface's.
    """
    validate.flag("anyway", anyway)
    if known is not None:
        own = energy(surface)
        if len(known.reactions) != surface.n or not math.isclose(known.energy, own, rel_tol=1e-9):
            text = "certificate: belongs to another surface; pass certify(surface), or leave it out"
            raise SurfaceError(text, what="certificate", found=known.energy, expected=own)
    certificate = certify(surface) if known is None else known
    require_certified(certificate, anyway)
    return certificate


def warning_mark(certificate: Certificate) -> str:
    """What each page about a surface that is not certified is marked with; empty for one that is."""
    verdict = certificate.verdict.value.split(":")[0]
    return "" if certificate.certified else f"NOT CERTIFIED: {verdict}"


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
    spectrum, system = count_soft(equilibrium, NEUTRAL / square, NEAR / square, clear)
    if system is not None and modes > 0:
        try:
            return spectrum, *lowest(system, modes)
        except SingularMatrix as error:
            spectrum = replace(spectrum, hidden=f"{error}; modes=0 judges by counts alone")
    return spectrum, np.empty(0), np.empty((0, 0, 3))


def _own_residuals(equilibrium: Equilibrium) -> Floats:
    """(patches,) the forces left inside each patch over the norm of its own triangles' forces.

    Of a patch with several islands, the worst one counts.
    """
    surface, classes = equilibrium.surface, equilibrium.classes
    island = islands(surface.topology)[classes.active]
    own = squared_forces(surface, classes, surface.vertices)
    island_of_vertex = np.zeros(surface.n, dtype=np.int64)
    island_of_vertex[classes.faces] = island[:, None]
    inside = equilibrium.unbalanced * (classes.kind == SHEET)[:, None]
    out = np.zeros(len(surface.patches))
    np.maximum.at(out, classes.patch_of_face, ratios(inside, island_of_vertex, own, island)[island])
    return np.sqrt(out)


def _largest(values: pd.Series) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else 0.0
