"""The derivatives of E and ∇E by the numbers that E is linear in, whatever their values are.

    ∂E/∂λ = Σ α̇ A - Σ (ṗ - ṡ) V + Σ ẇ ∫ z dA + Σ τ̇ L + Σ ġ ∫ z ds

Rates are given by kind, as in ``pcmc.surface.values.KINDS``: one for each patch or cable. A prescribed volume
is a condition beside E, and no part of it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..base.arrays import Floats
from ..surface import Surface
from .cable_weights import moments as moments_of_cables
from .cables import lengths
from .elements import Elements, add_values
from .functional import weighted
from .triangles import moments

Rates = Mapping[str, Floats]


def energy_by(surface: Surface, rates: Rates, X: Floats) -> float:
    """∂E/∂λ at X (n,3)."""
    none = np.zeros(len(surface.patches))
    areas, volumes, _ = weighted(surface, X=X)
    change = float(rates.get("tensions", none) @ areas)
    change -= float((rates.get("pressures", none) - rates.get("snows", none)) @ volumes)
    if "weights" in rates:
        change += float(rates["weights"] @ moments(surface, X, none))
    return change + _cables_by(surface, rates, X)


def gradient_by(surface: Surface, rates: Rates, X: Floats | None = None) -> Floats:
    """∂∇E/∂λ (n,3) at X or where the surface is, supports not applied."""
    X, none = surface.vertices if X is None else X, np.zeros(len(surface.patches))
    out = np.zeros_like(X)
    if not rates.keys().isdisjoint(("tensions", "pressures", "snows")):
        net = rates.get("pressures", none) - rates.get("snows", none)
        out = weighted(surface, rates.get("tensions", none), net, X)[2]
    if "weights" in rates:
        moments(surface, X, rates["weights"], out)
    _cables_by(surface, rates, X, out)
    return out


def _cables_by(surface: Surface, rates: Rates, X: Floats, gradient: Floats | None = None) -> float:
    """Σ τ̇ L + Σ ġ ∫ z ds at X (n,3); its gradient is added to ``gradient`` (n,3) if that is given."""
    none, elements = np.zeros(len(surface.cables)), list[Elements]()
    pulls, weights = rates.get("cables", none), rates.get("cable_weights", none)
    for cable, pull, weight in zip(surface.cables, pulls, weights, strict=True):
        each = np.ones(len(cable.edges))
        elements += [lengths(X, cable.edges).times(pull * each)] if pull else []
        elements += [moments_of_cables(surface, X, cable.edges, weight * each)] if weight else []
    return add_values(elements, gradient)
