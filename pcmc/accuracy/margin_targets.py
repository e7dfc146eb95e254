"""The quantity "margin" of targets: its value, and its slopes by tensions and loads in closed form.

At a fold the equations Bᵀ∇E = 0 have the left null vector φ, the mode, as they are symmetric. Along a change
dμ of a tension or a load the fold moves so that ⟨φ, ∂∇E/∂λ⟩ dλ + ⟨φ, ∂∇E/∂μ⟩ dμ = 0, whatever the shape:

    dλ/dμ = - ⟨φ, ∂∇E/∂μ⟩ / ⟨φ, ∂∇E/∂λ⟩

(Govaerts 2000, ch. 4). A number that λ multiplies changes its ∂μ by λ, too.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from ..base.arrays import Floats
from ..base.errors import OptionError
from ..base.tolerances import AT_REST
from ..certificate import certify
from ..certificate.measures import Measurement
from ..forces.functional import gradient_by
from ..surface import Surface
from .margins import Margin, MarginEnd, margin
from .varied import Varied


@lru_cache(maxsize=4)
def _known(surface: Surface, what: str) -> Margin | None:
    """Of the last surfaces, as value and slopes are asked for one after the other; None if not at rest."""
    certificate = certify(surface)
    at_rest = certificate.residual <= AT_REST
    return margin(surface, what, meshes=1, certificate=certificate) if at_rest else None


def measured_margin(surface: Surface, of: str | None) -> Measurement:
    """The factor of ``pcmc.margin``, on this mesh alone; constant without an end, NaN if not at rest."""
    what = of or "pressure"
    if surface.rooms:
        text = f"margin of {what}: as a target it needs rooms of given pressures, not volumes"
        raise OptionError(text, what="of", found=what)
    varied = Varied.of(surface, what)
    if varied.unit:
        raise OptionError(f"margin of {what}: it is 0 now, so it has no factor", what="of", found=what)
    found, still = _known(surface, what), np.zeros_like(surface.vertices)
    if found is None or not len(found.mode):
        return Measurement(math.nan if found is None else found.factor, still)
    if found.ends_by is not MarginEnd.FOLD:
        text = f"margin of {what}: it ends by a {found.ends_by.name.lower()}, whose slopes are not known;"
        raise OptionError(f"{text} as a target it has to end by a fold", what="of", found=what)
    end, phi, slopes = found.surface, found.mode, dict[str, Floats]()
    along = float((phi * varied.direction.line(end).gradient(end, end.vertices)).sum())
    walls = {(k, p.name) for k, _ in varied.parts if varied.what == k for p in end.patches if p.wall}
    for kind in ("tension", "pressure", "weight", "snow", "cable", "cable_weight"):
        names = [part.name for part in (end.cables if "cable" in kind else end.patches)]
        across = np.array([(phi * gradient_by(end, {f"{kind}s": one})).sum() for one in np.eye(len(names))])
        multiplied = [(kind, name) in {*varied.parts, *walls} for name in names]
        slopes[f"{kind}s"] = -across * np.where(multiplied, found.factor, 1.0) / along
    return Measurement(found.factor, still, slopes)
