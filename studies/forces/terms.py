"""Each term of the energy against Surface Evolver on the same mesh, and against its own differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

import generators
import pcmc
from generators import hypar_roof, schwarz_p
from pcmc import Surface, room_volumes
from pcmc.base.arrays import Floats
from pcmc.forces.functional import energy_and_gradient, energy_at
from pcmc.forces.rooms import room_pressures, with_room_pressures
from pcmc.forces.second_variation import hessian
from pcmc.surface.supports import apply_supports

from ..gallery.surfaces import bound
from ..reference import evolver
from .cases import hanging_barrel, heavy_bubble, pressed_tube, tube

TERMS: dict[str, Callable[[], Surface]] = {
    "cables": lambda: hypar_roof(8),
    "cables and weight": lambda: hypar_roof(8, weight=0.05),
    "weight, mirror planes": lambda: hanging_barrel(8),
    "sliding planes": lambda: pressed_tube(0.3),
    "mirror planes": lambda: schwarz_p(6),
    "volume, weight, sliding edge": lambda: heavy_bubble(0.3),
    "volume between plates": lambda: tube(0.3, 2.0),
    "volumes of two rooms": lambda: generators.double_bubble(0.4, volumes=(1.0, 0.7)),
    "volumes of three rooms": lambda: generators.triple_bubble(0.3),
}
STEPS = 1e-2 * 0.5 ** np.arange(3)
ROUNDING = 1e-13  # relative differences below are noise, which differs between machines


def table() -> pd.DataFrame:
    """A row per term: energies, the bounds on differences from the program, and the Taylor slopes.

    Where volumes are prescribed the program's energy leaves out the pressures of the rooms, so both do here.
    NaN where the program is not installed.
    """
    rows = []
    for term, build in TERMS.items():
        given = shaken(build())
        surface = with_room_pressures(given, -room_pressures(given)) if given.rooms else given
        expected, ours = pcmc.gradient(surface), pcmc.energy(surface)
        row = {"term": term, "triangles": surface.m, "energy": ours}
        energy = gradient = volume = float("nan")
        if evolver.available():
            energy = abs(evolver.energy(surface) / ours - 1.0)
            largest = np.abs(expected).max()
            gradient = float(np.abs(evolver.gradient(surface) - expected).max() / largest)
            if surface.rooms:
                out = evolver.run(surface, 'foreach body bb do printf "V %.17g\\n", bb.volume')
                theirs = evolver.numbers(out, "V", 1)[:, 0]
                volume = float(np.abs(theirs / room_volumes(surface) - 1.0).max())
        within = {"energy": energy, "gradient": gradient, "volume": volume}
        row |= {f"{name}_within": bound(max(error, ROUNDING)) for name, error in within.items()}
        rows.append(row | taylor(given))
    return pd.DataFrame(rows)


def shaken(surface: Surface) -> Surface:
    """Each vertex moved by about a hundredth of an edge as its support allows: no symmetry hides an error."""
    motion = apply_supports(surface, np.random.default_rng(0).standard_normal(surface.vertices.shape))
    return surface.moved(surface.vertices + 0.003 * surface.size / np.sqrt(surface.m) * motion)


def taylor(surface: Surface) -> dict[str, float]:
    """Slopes of E(X + t d) - E - t ∇E·d, and of the same less ½ t² d·∇²E d; theory: 2 and 3."""
    X, n = surface.vertices, surface.n
    d = apply_supports(surface, np.random.default_rng(1).standard_normal((n, 3)))
    value, forces = energy_and_gradient(surface, X)
    scale = surface.size / np.sqrt(surface.m)
    steps = scale * STEPS
    change: Floats = np.array([energy_at(surface, X + t * d) for t in steps]) - value
    first = change - steps * float((forces * d).sum())
    second = first - 0.5 * steps**2 * float(d.ravel() @ (hessian(surface) @ d.ravel()))
    return {
        f"slope_{name}": round(float(np.log2(np.abs(left[:-1] / left[1:]))[-1]), 2)
        for name, left in (("gradient", first), ("hessian", second))
    }
