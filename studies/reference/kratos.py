"""Kratos: a second finite-element program beside CalculiX, and its form finding beside other programs.

Its wheels (``pip install KratosMultiphysics KratosStructuralMechanicsApplication``) are large, so they are no
part of any extra here. ``KRATOS_PYTHON`` names an interpreter that has them; by default it is this one.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pcmc.base.arrays import Bools, Floats
from pcmc.base.errors import PcmcError
from pcmc.structure import StructuralModel
from pcmc.surface import Surface
from pcmc.surface.supports import apply_supports

PYTHON = "KRATOS_PYTHON"
SCRIPT = Path(__file__).with_name("kratos_script.py")
ALONG = 1e-9  # a component of a held direction below this is 0


class KratosError(PcmcError):
    """Kratos is absent, or found no equilibrium."""


@dataclass(frozen=True, eq=False)
class KratosResults:
    """The end of one step."""

    displacements: Floats  # (n,3)
    reactions: Floats  # (n,3) of the supports; 0 where nothing is held
    principal_stresses: Floats  # (e,2) ascending, of each element


def run(model: StructuralModel) -> tuple[KratosResults, ...]:
    """The results of each step of a model of isotropic membranes without cables and self-weight, whose
    supports hold along the axes of space."""
    s, materials = model.standing, set(model.materials)
    if s.cables or len(materials) > 1 or len(set(model.thicknesses)) > 1:
        raise KratosError("the comparison is of one material and thickness, without cables")
    (material,) = materials
    found = _answer(
        X=s.vertices,
        F=s.faces[model.active],
        fixed=_fixed(model.allowed) & model.held[:, None],
        prestress=model.prestress,
        pressures=[step.pressures[model.active] for step in model.steps],
        forces=[step.forces for step in model.steps],
        young=material.young,
        poisson=material.poisson,
        thickness=model.thicknesses[0],
    )
    if not found["good"].all():
        raise KratosError("Kratos: found no equilibrium")
    arrays = found["displacements"], found["reactions"], found["principal"]
    return tuple(
        KratosResults(u, np.where(model.held[:, None], r, 0.0), p) for u, r, p in zip(*arrays, strict=True)
    )


def form(
    surface: Surface, rest: float, limit: float, far: float, timeout: float
) -> tuple[float, Floats, str]:
    """The seconds that Kratos' form finding took, the vertices (n,3) it ended at, and what it says.

    It ends where the norm of the forces left, in all directions that the supports allow, is below ``rest``,
    after ``limit`` seconds, or where a coordinate is beyond ``far``. Reading the mesh is not counted.
    """
    ways = [apply_supports(surface, np.tile(axis, (surface.n, 1))) for axis in np.eye(3)]
    patch = surface.patch_of_face
    found = _answer(
        timeout,
        X=surface.vertices,
        F=surface.faces,
        fixed=_fixed(np.stack(ways, axis=2)),
        prestress=surface.tensions[patch],
        pressures=surface.net_pressures[patch],
        young=0.0,
        poisson=0.0,
        thickness=1.0,
        rest=rest,
        limit=limit,
        far=far,
    )
    return float(found["seconds"]), np.asarray(found["X"]), str(found["said"])


def _fixed(allowed: Floats) -> Bools:
    """(n,3) the axes of space along which supports hold; ``allowed`` (n,3,3) projects on what they leave."""
    fixed = np.asarray(np.einsum("nii->ni", np.eye(3) - allowed) > 0.5)
    if np.abs(allowed - np.einsum("ni,ij->nij", ~fixed, np.eye(3))).max() > ALONG:
        raise KratosError("Kratos is given supports along the axes of space only")
    return fixed


def _answer(timeout: float | None = None, **model: Any) -> dict[str, Any]:
    """The arrays that the script writes for those of a model."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "model.npz"), Path(folder, "answer.npz")
        np.savez(source, **model)
        command = [os.environ.get(PYTHON, sys.executable), str(SCRIPT), str(source), str(target)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=timeout)
        except subprocess.TimeoutExpired:
            raise KratosError(f"Kratos: not ready after {timeout:g} s") from None
        if done.returncode or not target.exists():
            lines = (done.stderr.strip() or "it stopped").splitlines()
            errors = [line for line in lines if "Error" in line]
            last = (errors or lines)[-1].strip()
            hint = (
                f"; install KratosStructuralMechanicsApplication, or name an interpreter with it in {PYTHON}"
            )
            raise KratosError(f"Kratos: {last}{hint if 'No module' in last else ''}")
        return dict(np.load(target))
