"""Surface Evolver as the reference: the same surface, the same questions, its answers.

The program (Debian package ``evolver-nox``) reads the datafile that ``pcmc.write`` makes.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import pcmc
from pcmc.base.arrays import Floats
from pcmc.surface.images import lattice_of
from pcmc.surface.supports import apply_supports

PROGRAM = "evolver"


class EvolverError(RuntimeError):
    """The program is absent, took too long, or did not answer."""


def available() -> bool:
    """Whether the program is installed."""
    return shutil.which(PROGRAM) is not None


def version() -> str:
    """What the program calls itself, or that it is not installed."""
    if not available():
        return "not installed"
    done = subprocess.run(
        [PROGRAM, "-V"], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60
    )
    return (done.stdout.strip() or "unknown").splitlines()[0]


def run(surface: pcmc.Surface, commands: str, timeout: float = 600.0, upright: bool = False) -> str:
    """What the program prints for commands (one or more lines) given on the surface.

    With ``upright`` volumes are ∫ z dA instead of a third of ∫ ⟨x, ν⟩ dA: the same number where Π is
    z = 0 and holds the whole boundary, and a Newton step ten times as fast.
    """
    with tempfile.TemporaryDirectory() as folder:
        datafile = Path(folder) / "surface.fe"
        pcmc.write(datafile, surface)
        text = datafile.read_text()
    return run_datafile(text.replace("SYMMETRIC_CONTENT\n", "", 1) if upright else text, commands, timeout)


def run_datafile(text: str, commands: str, timeout: float = 600.0) -> str:
    """What the program prints for commands given on the surface of a datafile's text."""
    with tempfile.TemporaryDirectory() as folder:
        datafile = Path(folder) / "surface.fe"
        datafile.write_text(f"{text}\nautodisplay off\n{commands}\nquit\nquit\n")
        try:
            done = subprocess.run(
                [PROGRAM, "-x", str(datafile)],
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=timeout,
                cwd=folder,
                check=False,
            )
        except FileNotFoundError:
            raise EvolverError(f"{PROGRAM} is not installed (Debian: evolver-nox)") from None
        except subprocess.TimeoutExpired:
            raise EvolverError(f"{PROGRAM} did not finish within {timeout:g} s") from None
    if "ERROR" in done.stderr or "syntax error" in done.stderr:
        errors = re.findall(r"^.*(?:ERROR|syntax error).*$", done.stderr, re.M)
        raise EvolverError(f"{PROGRAM}: {'; '.join(errors)}")
    return done.stdout


def torus_datafile(surface: pcmc.Surface) -> str:
    """The text of a datafile for a surface that is periodic in three directions, in the torus of its cell.

    An edge from a to b is given with how often it wraps around each side of the cell, -, * or + once all
    vertices are moved into one cell. Each room is a body.
    """
    topo, T = surface.topology, lattice_of(surface)
    used = np.unique(topo.faces)
    X = surface.vertices - np.floor(surface.vertices @ np.linalg.inv(T) + 1e-9) @ T
    (a, b), (start, end) = topo.edges.T, surface.vertices[topo.sides.T]
    wraps = np.rint((end - start - (X[b] - X[a])) @ np.linalg.inv(T)).astype(int)
    if np.abs(wraps).max() > 1:
        raise EvolverError("an edge wraps around the cell more than once; take a finer mesh")
    place = np.full(surface.n, -1)
    place[used] = np.arange(1, len(used) + 1)
    lines = ["TORUS", "periods", *(" ".join(map(repr, row)) for row in T.tolist()), "", "vertices"]
    lines += [f"{place[v]} {x!r} {y!r} {z!r}" for v, (x, y, z) in zip(used, X[used].tolist(), strict=True)]
    signs = np.array(["-", "*", "+"])[wraps + 1]
    ends = zip(place[a].tolist(), place[b].tolist(), signs.tolist(), strict=True)
    lines += ["", "edges", *(f"{k} {i} {j} {' '.join(w)}" for k, (i, j, w) in enumerate(ends, 1))]
    sides = ((topo.edge_of_face + 1) * topo.sense)[:, [2, 0, 1]].tolist()
    pulls = surface.tensions[surface.patch_of_face].tolist()
    faces = enumerate(zip(sides, pulls, strict=True), 1)
    lines += ["", "faces", *(f"{k} {i} {j} {l} tension {t!r}" for k, ((i, j, l), t) in faces)]
    lines += ["", "bodies"] * bool(surface.rooms)
    for k, room in enumerate(surface.rooms):
        own = np.arange(1, surface.m + 1) * surface.room_signs[k][surface.patch_of_face].astype(int)
        lines.append(f"{k + 1} {' '.join(map(str, own[own != 0].tolist()))} volume {room.volume!r}")
    return "\n".join([*lines, "", "read"])


def energy(surface: pcmc.Surface, commands: str = "", upright: bool = False) -> float:
    """The program's ``total_energy``, E of Eq. (20), after the commands, if any."""
    out = run(surface, commands + '\nprintf "E %.17g\\n", total_energy', upright=upright)
    return float(numbers(out, "E", 1)[-1, 0])


def gradient(surface: pcmc.Surface) -> Floats:
    """∇E (n,3) as the program has it, the supports applied as in ``pcmc.gradient``.

    The vertex attribute ``__force`` holds -∂E/∂x of all terms, before supports; it is filled by an
    iteration, and ``m 0`` makes that iteration move nothing. ``convert_to_quantities`` matters when
    patches differ in pressure: without it the forces are not the derivative of ``total_energy``. With it
    they lack those of line tensions, so cables cannot be compared where pressures differ.
    """
    convert = "convert_to_quantities\n"
    if len(surface.cable_edges.ends):
        if len(np.unique(surface.net_pressures[surface.net_pressures != 0.0])) > 1:
            raise EvolverError(f"{PROGRAM}: no forces of cables where patches differ in pressure")
        convert = ""
    out = run(
        surface,
        f"{convert}define vertex attribute __force real[3]\nm 0\ng 1\n"
        'foreach vertex vv do printf "F %.17g %.17g %.17g\\n",'
        " vv.__force[1], vv.__force[2], vv.__force[3]",
    )
    return apply_supports(surface, -numbers(out, "F", 3))


def positions(surface: pcmc.Surface, commands: str, upright: bool = False) -> Floats:
    """(n,3) vertices after the commands, which must keep the mesh."""
    show = '\nforeach vertex vv do printf "X %.17g %.17g %.17g\\n", x, y, z'
    out = run(surface, commands + show, upright=upright)
    return numbers(out, "X", 3) + surface.origin


@dataclass(frozen=True)
class Inertia:
    """Counts of eigenvalues of the Hessian below, at and above the probe."""

    negative: int
    zero: int
    positive: int


def inertia(surface: pcmc.Surface, probe: float = 0.0, normal: bool = True) -> Inertia:
    """The program's ``eigenprobe``.

    With ``normal`` vertices move along the normal in a sheet, across the curve at a junction, in all
    directions at a point, and in what of this the support allows: as many unknowns as the motion
    space of ``pcmc.motion`` has. Without, all free coordinates are unknowns.
    """
    out = run(surface, f"hessian_normal {'on' if normal else 'off'}\neigenprobe {probe!r}")
    counts = re.search(r"Eigencounts:\s*(\d+)\s*<,\s*(\d+)\s*==,\s*(\d+)\s*>", out)
    if counts is None:
        raise EvolverError(f"{PROGRAM} gave no eigenvalue counts: {' '.join(out.split())[-200:]}")
    return Inertia(*map(int, counts.groups()))


def seconds(
    surface: pcmc.Surface, commands: str, before: str = "", repeat: int = 1, upright: bool = False
) -> Floats:
    """(repeat,) processor seconds of the commands, by the program's own clock.

    ``before`` runs first, untimed. Reading the file is not counted.
    """
    timed = f'clock_was := clock\n{commands}\nprintf "T %.17g\\n", clock - clock_was\n'
    script = "clock_was := 0.0\n" + before + "\n" + timed * repeat
    out = run(surface, script, timeout=3600.0, upright=upright)
    return numbers(out, "T", 1)[:, 0]


def numbers(out: str, key: str, columns: int) -> Floats:
    """(k,columns) numbers of the lines that start with the key."""
    text = " ".join(re.findall(rf"^(?:Enter command: )?{key}((?: \S+){{{columns}}})$", out, re.M))
    numbers = np.array(re.sub("[()]", "", text).split(), dtype=float).reshape(-1, columns)  # it has (NaN)
    if not len(numbers):
        raise EvolverError(f"{PROGRAM} did not answer: {' '.join(out.split())[-200:]}")
    return numbers
