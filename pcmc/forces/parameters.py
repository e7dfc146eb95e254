"""The derivatives of E and ∇E by the numbers that E is linear in, whatever their values are.

    ∂E/∂λ = Σ α̇ A - Σ (ṗ - ṡ) V + Σ ẇ ∫ z dA + Σ τ̇ L

Rates are given by kind, as in ``pcmc.surface.values.KINDS``: one for each patch or cable. A prescribed volume
is a condition beside E, and no part of it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..base.arrays import Floats
from ..surface import Surface
from ..surface.geometry import segment_lengths
from .cables import add_pull
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
    for k in np.flatnonzero(rates.get("cables", ())):
        change += float(rates["cables"][k] * segment_lengths(X, surface.cables[k].edges).sum())
    return change


def gradient_by(surface: Surface, rates: Rates, X: Floats | None = None) -> Floats:
    """∂∇E/∂λ (n,3) at X or where the surface is, supports not applied."""
    X, none = surface.vertices if X is None else X, np.zeros(len(surface.patches))
    out = np.zeros_like(X)
    if not rates.keys().isdisjoint(("tensions", "pressures", "snows")):
        net = rates.get("pressures", none) - rates.get("snows", none)
        out = weighted(surface, rates.get("tensions", none), net, X)[2]
    if "weights" in rates:
        moments(surface, X, rates["weights"], out)
    for k in np.flatnonzero(rates.get("cables", ())):
        add_pull(X, surface.cables[k].edges, float(rates["cables"][k]), out)
    return out
