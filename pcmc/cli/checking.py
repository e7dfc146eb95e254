"""The mesh check of a command: whether it is made, and why not; and the margins."""

from __future__ import annotations

import sys
from collections.abc import Sequence

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


def margins(roof: Outcome, wanted: Sequence[str] = ()) -> None:
    """Find and print the margins wanted; of a certified roof also those that its project asks for."""
    own = roof.project.margin if roof.project is not None and roof.certified else ()
    sys.stdout.flush()
    for what in dict.fromkeys([*wanted, *own]):
        with working() as say:
            found = roof.margin(what, say)
        print(f"margin: {found.text(roof.units)}")
