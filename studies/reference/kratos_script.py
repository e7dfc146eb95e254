"""Run by an interpreter that has Kratos: ``python kratos_script.py MODEL.npz ANSWER.npz``.

Membranes of three nodes, prestressed alike in all directions of their planes; pressures that follow them,
and forces at the nodes. Each step of a structural model starts from the one before. A model with ``rest``,
forces to come below, is one whose form is sought: Kratos' ``FormfindingStrategy`` counts displacements from
the last form and keeps the prestress.
"""

from __future__ import annotations

import sys
import time
from importlib import import_module
from typing import Any

import numpy as np

MODULES = (
    "",
    ".StructuralMechanicsApplication",
    ".LinearSolversApplication",
    ".python_linear_solver_factory",
)
MOST, ITERATIONS = 100_000, 20  # of a form's search; before each look at the clock
PROJECTION = """{"model_part_name": "Structure", "echo_level": 0, "projection_type": "planar",
    "global_direction": [0.6, 0.64, 0.48], "variable_name": "LOCAL_PRESTRESS_AXIS_1",
    "visualize_in_vtk": false, "method_specific_settings": {}, "check_local_space_dimension": false}"""
PARTS = 4  # increments of a step after the first
TOLERANCE = 1e-8  # of the largest prestress force: the residual


def main(source: str, target: str) -> None:
    KM, SM, _, factory = (import_module(f"KratosMultiphysics{name}") for name in MODULES)
    given = np.load(source)
    part, pressed, pushed = _part(KM, SM, given)
    solver = factory.ConstructSolver(KM.Parameters('{"solver_type": "LinearSolversApplication.sparse_lu"}'))
    parts = KM.ResidualBasedIncrementalUpdateStaticScheme(), KM.ResidualBasedBlockBuilderAndSolver(solver)
    if "rest" in given:
        answer = _form(KM, SM, given, part, pressed, *parts)
    else:
        answer = _steps(KM, SM, given, part, pressed, pushed, *parts)
    arrays: dict[str, Any] = {name: np.array(values) for name, values in answer.items()}
    np.savez(target, **arrays)


def _part(KM: Any, SM: Any, given: Any) -> tuple[Any, list[Any], list[Any]]:
    """The model, a condition with the pressure of each triangle, and one with the force on each node."""
    X, F, used = given["X"], given["F"], np.unique(given["F"])
    part = KM.Model().CreateModelPart("Structure")
    part.SetBufferSize(2)
    part.ProcessInfo[KM.DOMAIN_SIZE] = 3
    for variable in (KM.DISPLACEMENT, KM.REACTION, KM.VOLUME_ACCELERATION, SM.POINT_LOAD):
        part.AddNodalSolutionStepVariable(variable)
    for node in used.tolist():
        part.CreateNewNode(node + 1, *X[node].tolist())

    properties: dict[float, Any] = {}
    for k, (face, stress) in enumerate(zip(F, given["prestress"].tolist(), strict=True), 1):
        if stress not in properties:
            properties[stress] = _properties(KM, SM, part, given, stress)
        element = part.CreateNewElement("MembraneElement3D3N", k, (face + 1).tolist(), properties[stress])
        edge = X[face[1]] - X[face[0]]
        element.SetValue(SM.LOCAL_PRESTRESS_AXIS_1, KM.Array3((edge / np.linalg.norm(edge)).tolist()))
    any_ = next(iter(properties.values()))
    nodes = [(face + 1).tolist() for face in F]
    pressed = [
        part.CreateNewCondition("SurfaceLoadCondition3D3N", k, n, any_) for k, n in enumerate(nodes, 1)
    ]
    pushed = [
        part.CreateNewCondition("PointLoadCondition3D1N", len(F) + k, [node + 1], any_)
        for k, node in enumerate(used.tolist(), 1)
    ]
    for k, axis in enumerate("XYZ"):
        moved, held = getattr(KM, f"DISPLACEMENT_{axis}"), getattr(KM, f"REACTION_{axis}")
        KM.VariableUtils().AddDof(moved, held, part)
        for node in used[given["fixed"][used, k]].tolist():
            part.GetNode(node + 1).Fix(moved)
    return part, pressed, pushed


def _steps(
    KM: Any, SM: Any, given: Any, part: Any, pressed: Any, pushed: Any, scheme: Any, builder: Any
) -> dict[str, list[Any]]:
    """Displacements, reactions and stresses at the end of each step."""
    X, F, used = given["X"], given["F"], np.unique(given["F"])
    least = TOLERANCE * float(given["prestress"].max() * given["thickness"] * np.ptp(X)) / len(F) ** 0.5
    ends = KM.ResidualCriteria(TOLERANCE, least)
    newton = KM.ResidualBasedNewtonRaphsonStrategy(part, scheme, ends, builder, 50, True, False, True)
    newton.SetEchoLevel(0)
    newton.Initialize()
    pressures, forces = np.zeros(len(F)), np.zeros_like(X)
    answers: dict[str, list[Any]] = {name: [] for name in ("displacements", "reactions", "principal", "good")}
    for step, (last, push) in enumerate(zip(given["pressures"], given["forces"], strict=True)):
        good, count = True, PARTS if step else 1
        for k in range(1, count + 1):
            part.CloneTimeStep(part.ProcessInfo[KM.TIME] + 1.0)
            for condition, p in zip(pressed, pressures + k / count * (last - pressures), strict=True):
                condition.SetValue(KM.NEGATIVE_FACE_PRESSURE, float(p))
            for condition, f in zip(pushed, (forces + k / count * (push - forces))[used], strict=True):
                condition.SetValue(SM.POINT_LOAD, KM.Array3(f.tolist()))
            newton.InitializeSolutionStep()
            newton.Predict()
            good = newton.SolveSolutionStep() and good
            newton.FinalizeSolutionStep()
        pressures, forces = last, push
        at = {name: np.zeros_like(X) for name in ("displacements", "reactions")}
        for node in used.tolist():
            found = part.GetNode(node + 1)
            at["displacements"][node] = list(found.GetSolutionStepValue(KM.DISPLACEMENT))
            at["reactions"][node] = list(found.GetSolutionStepValue(KM.REACTION))
        stress = SM.PRINCIPAL_CAUCHY_STRESS_VECTOR
        principal = [list(e.CalculateOnIntegrationPoints(stress, part.ProcessInfo)[0]) for e in part.Elements]
        for name, values in (at | {"principal": np.sort(principal, axis=1), "good": good}).items():
            answers[name].append(values)
    return answers


def _form(KM: Any, SM: Any, given: Any, part: Any, pressed: Any, scheme: Any, builder: Any) -> dict[str, Any]:
    """The form, the seconds it took, and what to say of it."""
    for condition, p in zip(pressed, given["pressures"].tolist(), strict=True):
        condition.SetValue(KM.NEGATIVE_FACE_PRESSURE, p)
    least = float(given["rest"]) / np.count_nonzero(~given["fixed"])
    ends = KM.ResidualCriteria(0.0, least)  # Kratos divides the norm by the number of unknowns
    ends.SetEchoLevel(0)
    about = KM.Parameters(PROJECTION)
    some = part, scheme, ends, builder, part, False, "none", about, ITERATIONS, False, False, True
    strategy = SM.FormfindingStrategy(*some)
    strategy.SetEchoLevel(0)
    strategy.Initialize()
    begin, count, said = time.perf_counter(), 0, f"not at rest after {MOST} iterations"
    X = given["X"]
    while count < MOST:
        part.CloneTimeStep(part.ProcessInfo[KM.TIME] + 1.0)
        strategy.InitializeSolutionStep()
        strategy.Predict()
        good = strategy.SolveSolutionStep()
        strategy.FinalizeSolutionStep()
        count += part.ProcessInfo[KM.NL_ITERATION_NUMBER]
        X = np.array([[node.X, node.Y, node.Z] for node in part.Nodes])
        if good or not np.isfinite(X).all() or np.abs(X).max() > given["far"]:
            said = f"at rest after {count} iterations" if good else "nothing, though its surface has run away"
            break
        if time.perf_counter() - begin > given["limit"]:
            said = f"stopped at {float(given['limit']):g} s, iteration {count}"
            break
    return {"X": X, "seconds": time.perf_counter() - begin, "said": said}


def _properties(KM: Any, SM: Any, part: Any, given: Any, stress: float) -> Any:
    """The material, with a prestress."""
    made = part.CreateNewProperties(part.NumberOfProperties() + 1)
    names = {KM.YOUNG_MODULUS: "young", KM.POISSON_RATIO: "poisson", KM.THICKNESS: "thickness"}
    for variable, name in names.items():
        made.SetValue(variable, float(given[name]))
    made.SetValue(KM.DENSITY, 0.0)
    law = KM.KratosGlobals.GetConstitutiveLaw("LinearElasticPlaneStress2DLaw")
    made.SetValue(KM.CONSTITUTIVE_LAW, law.Clone())
    vector = KM.Vector(3)
    vector[0], vector[1], vector[2] = stress, stress, 0.0
    made.SetValue(SM.PRESTRESS_VECTOR, vector)
    return made


if __name__ == "__main__":
    main(*sys.argv[1:])
