"""Run by an interpreter that has jax_fdm: ``python jax_fdm_script.py SURFACE.npz ANSWER.npz``.

A net with a bar for each edge of the triangles, whose force densities and loads follow its shape.
"""

from __future__ import annotations

import sys
import time
from importlib import import_module
from typing import Any

import numpy as np

MOST = 100_000  # iterations


def main(source: str, target: str) -> None:
    import_module("jax").config.update("jax_enable_x64", True)
    equilibrium = import_module("jax_fdm.equilibrium")
    network = import_module("jax_fdm.datastructures").FDNetwork
    given = np.load(source)
    X, F, fixed = given["X"].copy(), given["F"], given["fixed"]
    sides = np.sort(np.concatenate([F[:, [1, 2]], F[:, [2, 0]], F[:, [0, 1]]]), axis=1)
    edges, place = np.unique(sides, axis=0, return_inverse=True)
    net = network.from_nodes_and_edges(X.tolist(), [tuple(edge) for edge in edges.tolist()])
    net.nodes_supports(np.flatnonzero(fixed).tolist())
    q, loads, _ = forces(given, X, edges, place)
    net.edges_forcedensities(keys=[tuple(edge) for edge in edges.tolist()], q=1.0)
    structure = equilibrium.EquilibriumStructureSparse.from_network(net)
    model = import_module("equinox").filter_jit(equilibrium.EquilibriumModelSparse())
    said, begin = f"not at rest after {MOST} iterations", time.perf_counter()
    for iteration in range(MOST):
        X = solved(equilibrium, model, structure, q, X[fixed], loads)
        if iteration == 0:
            begin = time.perf_counter()  # the first one compiles
        q, loads, residual = forces(given, X, edges, place)
        if not np.isfinite(X).all() or residual <= given["rest"]:
            said = (
                f"at rest after {iteration + 1} iterations" if residual <= given["rest"] else "not a number"
            )
            break
        if time.perf_counter() - begin > given["limit"]:
            said = f"stopped at {float(given['limit']):g} s, iteration {iteration + 1}"
            break
    np.savez(target, X=X, seconds=time.perf_counter() - begin, said=said)


def solved(equilibrium: Any, model: Any, structure: Any, q: Any, supports: Any, loads: Any) -> Any:
    """The net in equilibrium with these force densities and loads."""
    state = equilibrium.LoadState(nodes=loads, edges=0.0, faces=0.0)
    parameters = equilibrium.EquilibriumParametersState(q=q, xyz_fixed=supports, loads=state)
    return np.asarray(model(parameters, structure).xyz)


def forces(given: Any, X: Any, edges: Any, place: Any) -> tuple[Any, Any, float]:
    """Force densities of the edges, loads of the nodes, and the residual relative to single triangles."""
    F, n = given["F"], len(X)
    corners = X[F]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(area, axis=1)
    q = np.zeros(len(edges))
    pull = np.zeros((n, 3))
    for k in range(3):
        a, b = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        share = given["tension"] * np.einsum("ij,ij->i", a, b) / (4.0 * size)
        np.add.at(q, place[k * len(F) : (k + 1) * len(F)], share)
    loads = np.zeros((n, 3))
    push = (given["pressure"] / 3.0)[:, None] * area
    for k in range(3):
        np.add.at(loads, F[:, k], push)
    along = q[:, None] * (X[edges[:, 1]] - X[edges[:, 0]])
    np.add.at(pull, edges[:, 0], along)
    np.add.at(pull, edges[:, 1], -along)
    free = ~given["fixed"]
    scale = np.sqrt(
        (np.linalg.norm(corners[:, 1] - corners[:, 2], axis=1) ** 2 * (given["tension"] / 2) ** 2).sum() * 3
    )
    return q, loads, float(np.linalg.norm((pull + loads)[free]) / scale)


if __name__ == "__main__":
    main(*sys.argv[1:])
