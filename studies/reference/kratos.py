"""Kratos as a second finite-element program beside CalculiX, on the same structural models.

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

import numpy as np

from pcmc.base.arrays import Floats
from pcmc.base.errors import PcmcError
from pcmc.structure import StructuralModel

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
    fixed = np.einsum("nii->ni", np.eye(3) - model.allowed) > 0.5
    askew = np.abs(model.allowed - np.einsum("ni,ij->nij", ~fixed, np.eye(3))).max() > ALONG
    if s.cables or len(materials) > 1 or len(set(model.thicknesses)) > 1 or askew:
        raise KratosError("the comparison is of one material and thickness, held along the axes of space")
    (material,) = materials
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "model.npz"), Path(folder, "answer.npz")
        np.savez(
            source,
            X=s.vertices,
            F=s.faces[model.active],
            fixed=fixed & model.held[:, None],
            prestress=model.prestress,
            pressures=[step.pressures[model.active] for step in model.steps],
            forces=[step.forces for step in model.steps],
            young=material.young,
            poisson=material.poisson,
            thickness=model.thicknesses[0],
        )
        interpreter = os.environ.get(PYTHON, sys.executable)
        done = subprocess.run([interpreter, SCRIPT, source, target], capture_output=True, text=True)
        if done.returncode or not target.exists():
            last = (done.stderr.strip() or "it stopped").splitlines()[-1]
            hint = f"install KratosStructuralMechanicsApplication, or name an interpreter with it in {PYTHON}"
            raise KratosError(f"Kratos: {last}; {hint}")
        found = np.load(target)
        if not found["good"].all():
            raise KratosError("Kratos: found no equilibrium")
        arrays = found["displacements"], found["reactions"], found["principal"]
    return tuple(
        KratosResults(u, np.where(model.held[:, None], r, 0.0), p) for u, r, p in zip(*arrays, strict=True)
    )
