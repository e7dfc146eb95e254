"""Refuse or mark a surface that is not certified, where something is to be built after it."""

from __future__ import annotations

import math

from ..base import validate
from ..base.errors import SurfaceError
from ..forces.functional import energy
from ..surface import Surface
from .certificate import Certificate, certify


def certified(surface: Surface, anyway: bool, known: Certificate | None = None) -> Certificate:
    """The certificate of a surface, where it is not ``known``; SurfaceError if the surface is not certified,
    unless ``anyway``, and if the known certificate belongs to another surface."""
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
