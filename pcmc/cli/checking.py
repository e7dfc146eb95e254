"""The mesh check of a command: whether it is made, and why not."""

from __future__ import annotations

import sys

from ..accuracy import MeshCheck
from ..project import MOST_CHECKED, Outcome
from .progress import working

CHECKED = f"Solve on two finer meshes, too, for error bars; by default up to {MOST_CHECKED} triangles."


def mesh_check(roof: Outcome, wanted: bool | None = None) -> MeshCheck | None:
    """The check of a roof at rest; None where it is not wanted, and, with a line why, not possible."""
    if not roof.wants_mesh_check(wanted):
        if roof.certificate.index is not None and roof.mesh_check_wanted(wanted) is None:
            print(f"mesh check left out above {MOST_CHECKED} triangles; --mesh-check does it")
        return None
    sys.stdout.flush()
    with working() as say:
        check = roof.check_mesh(say)
    if check is None:  # the surface and its files are good without it
        print(f"no mesh check: {roof.mesh_failure}")
    return check
