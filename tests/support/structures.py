"""Structural models for tests, and result files as CalculiX writes them, with any numbers."""

from __future__ import annotations

import numpy as np

from pcmc import Cable, Material, Patch, Profile, SelfWeight, Snow, Surface, Wind
from pcmc.structure import StepResults, StructuralModel, analyse

FABRIC = Material(young=1e6, poisson=0.3, density=0.1)
LOADS = [SelfWeight(), Snow(0.5), (Snow(0.2), Wind({"roof": 0.3}))]
COLUMNS = {
    "displacements": ("vx,vy,vz", "NALL"),
    "forces": ("fx,fy,fz", "HELD"),
    "stresses": ("elem, integ.pnt.,sxx,syy,szz,sxy,sxz,syz", "EALL"),
}


def square(n: int = 4, tension: float = 2.0, cable: float | None = None, turn=None) -> Surface:
    """A flat film over the unit square, held at its rim, with a straight cable through its middle."""
    side = np.linspace(0.0, 1.0, n + 1)
    X = np.array([[x, y, 0.0] for y in side for x in side])
    first = np.array([j * (n + 1) + i for j in range(n) for i in range(n)])
    lower, upper = np.array([0, 1, n + 2]), np.array([0, n + 2, n + 1])
    F = np.concatenate([first[:, None] + lower, first[:, None] + upper])
    rim = np.flatnonzero(((X == 0.0) | (X == 1.0))[:, :2].any(axis=1))
    middle = n // 2 * (n + 1) + np.arange(n + 1)
    cables = [] if cable is None else [Cable.along("tie", cable, middle)]
    X = X if turn is None else X @ turn.T
    return Surface(X, F, np.zeros(len(F), int), [Patch("film", tension, 0.0)], fixed=rim, cables=cables)


def pyramid() -> Surface:
    """The least roof: four triangles and one free vertex, at rest."""
    corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.125**0.5]]
    faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    return Surface(corners, faces, [0] * 4, [Patch("roof", 1.0)], fixed=range(4))


def model_of(surface: Surface, **more: object) -> StructuralModel:
    """The model of a surface in FABRIC, a thousandth thick."""
    return StructuralModel(surface, **{"material": FABRIC, "thickness": 1e-3, **more})


def scaled(profile: Profile, factor: float) -> Profile:
    """The profile with ``factor`` times the area and the second moments."""
    return Profile(factor * profile.area, *(factor * moment for moment in profile.moments))


def results_of(model: StructuralModel) -> list[StepResults]:
    """The results of each step of a model that carries all of its loads, by CalculiX."""
    analysis = analyse(model, remedy=False)
    assert analysis.carried
    return [case.results for case in analysis.cases]


def dat_text(model: StructuralModel, seed: int = 0) -> tuple[str, list[dict[str, np.ndarray]]]:
    """A .dat file of random numbers for each step of a model, and the numbers."""
    rng, text, steps = np.random.default_rng(seed), "\n", []
    nodes, held = (np.flatnonzero(mask) + 1 for mask in (model.nodes, model.held))
    elements = np.repeat(model.faces + 1, 2)
    points = np.tile([1, 2], len(model.faces))
    for number in range(1, len(model.steps) + 1):
        values = {
            "displacements": rng.normal(size=(len(nodes), 3)).round(6),
            "forces": rng.normal(size=(len(held), 3)).round(6),
            "stresses": rng.normal(size=(len(elements), 6)).round(6),
        }
        keys = {"displacements": [nodes], "forces": [held], "stresses": [elements, points]}
        for kind, (columns, group) in COLUMNS.items():
            text += f" {kind} ({columns}) for set {group} and time  {float(number):.7E}\n\n"
            for row in zip(*keys[kind], values[kind], strict=True):
                text += "".join(f"{key:10d}" for key in row[:-1])
                text += "".join(f" {v:13.6E}" for v in row[-1]) + "\n"
            text += "\n"
        steps.append(values)
    return text, steps
