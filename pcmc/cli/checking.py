"""The mesh check of a command: whether it is made, and why not."""

from __future__ import annotations

import sys
from collections.abc import Callable

from ..accuracy import MeshCheck
from ..base.errors import PcmcError
from ..certificate.certificate import Certificate
from ..project import MOST_CHECKED, OnStep
from ..surface import Surface
from .progress import working

CHECKED = f"Solve on two finer meshes, too, for error bars; by default up to {MOST_CHECKED} triangles."


def mesh_check(
    surface: Surface, certificate: Certificate, wanted: bool | None, check: Callable[[OnStep], MeshCheck]
) -> MeshCheck | None:
    """The check of a surface at rest; None where it is not wanted, and, with a line why, not possible."""
    if certificate.index is None or wanted is False:
        return None
    if wanted is None and surface.m > MOST_CHECKED:
        print(f"mesh check left out above {MOST_CHECKED} triangles; --mesh-check does it")
        return None
    sys.stdout.flush()
    try:
        with working() as say:
            return check(say)
    except PcmcError as error:  # the surface and its files are good without it
        print(f"no mesh check: {error}")
        return None
