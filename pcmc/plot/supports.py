"""What the supports exert, as arrows on a surface."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.errors import OptionError
from ..certificate.balance import reactions_per_length
from ..surface import Surface
from .figure import Image
from .pictures import Path, vectors


def reactions(surface: Surface, path: Path | None = None, **how: Any) -> Image:
    """Arrows of the reactions along the held boundary, force per length; see ``reactions_per_length``.

    ``how`` is as in ``vectors``: view, length, most, label, title, supports, edges, width, renderer.

    Raises
    ------
    OptionError : where no boundary is held, so that there are no reactions.
    """
    found = reactions_per_length(surface)
    if np.isnan(found).all():
        raise OptionError("no boundary of the surface is held: there are no reactions to draw")
    return vectors(surface, np.nan_to_num(found), path, **{"label": "force/length", **how})
