"""How fast the discrete surfaces come to the smooth ones: order, time and memory of each example.

A family is one mesh cut 1→4 again and again, the new vertices of round outlines put on their circles.
On each level the geometric solver goes on from the level above. All but one go to 250 000 triangles.

That one is Example 2 as printed. At its corners the crest turns with the edge length (``stability``), no
one mesh can follow it, and it is meshed anew each time; from an edge length of 0.19 (10 208 triangles) on
the triangles at a corner collapse, and the last that converges has 9 219. A smaller patch of tension
√11 = 3.317 instead of 3 would make it two spheres that join in balance along the whole crest, corners too
(``joined_caps``). Near that the corners hold longer: at 3.2, ``example2_near``, on all meshes here. There
too the crest turns, so energies converge with order 2 and positions do not.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np
import pandas as pd

from generators import (
    bezier_hall,
    four_fans,
    joined_caps,
    joined_caps_exact,
    spherical_cap,
    spherical_cap_exact,
    two_caps,
    two_squares,
)
from generators.exact import ExactSolution, Sphere
from generators.two_caps import LARGE, SMALL
from pcmc import Surface, solve
from pcmc.base.arrays import Floats
from pcmc.meshing.refinement import refine
from pcmc.solvers.result import Result
from pcmc.surface.geometry import area_vectors, face_areas

from ..benchmarks.timing import peak_bytes
from ..examples.flow import NOISE_RESIDUAL, errors
from ..folder import Folder
from ..orders import Order, limit_order, slope
from ..study import Study

Circle = tuple[float, float, float]  # x, y and radius of an arc of the outline, on Π


@dataclass(frozen=True)
class Family:
    """An example on finer and finer meshes.

    Attributes
    ----------
    build : the coarsest mesh, or with ``lengths`` the mesh of an edge length.
    levels : how many meshes.
    circles : that the outline is made of; none for an outline of straight lines.
    exact : the solution in closed form, if there is one.
    lengths : edge lengths of meshes made anew, instead of refinements.
    """

    name: str
    title: str
    build: Callable[..., Surface]
    levels: int
    circles: Sequence[Circle] = ()
    exact: Callable[[], ExactSolution] | None = None
    lengths: Sequence[float] = ()

    def solved(self, levels: int) -> Iterator[tuple[Result, float]]:
        """On each level what the solver finds, and its processor time."""
        surface = None
        for level in range(levels):
            if self.lengths:
                surface = self.build(self.lengths[level])
            elif surface is None:
                surface = self.build()
            else:
                surface = refine(surface, 1, self.rounded if self.circles else None)
            begin = time.process_time()
            result = solve(surface, "newton", target="stationary")
            yield result, time.process_time() - begin
            surface = result.surface

    def rounded(self, points: Floats) -> Floats:
        """(k,3) points of the outline, each put on the circle that is nearest."""
        moved = np.array([_onto(circle, points) for circle in self.circles])
        apart = np.linalg.norm(moved - points, axis=2)
        return np.asarray(moved[apart.argmin(axis=0), np.arange(len(points))])


def _onto(circle: Circle, points: Floats) -> Floats:
    x, y, radius = circle
    away = points[:, :2] - [x, y]
    on = [x, y] + radius * away / np.linalg.norm(away, axis=1)[:, None]
    return np.column_stack([on, points[:, 2]])


def _outlines(exact: ExactSolution) -> list[Circle]:
    """The circles in which the spheres of a closed form meet Π."""
    balls = [shape for shape in exact.shapes.values() if isinstance(shape, Sphere)]
    return [(b.centre[0], b.centre[1], (b.radius**2 - b.centre[2] ** 2) ** 0.5) for b in balls]


def _squares() -> Surface:
    return two_squares(4, alpha_aux=1.0)


def _cap() -> Surface:
    return spherical_cap(1.0 / 7.0)


def _joined() -> Surface:
    return joined_caps(1.05)


def _near() -> Surface:
    return two_caps(1.15, alpha_small=3.2)


def _fans() -> Surface:
    return four_fans(6)


def _hall() -> Surface:
    return bezier_hall(11.8)


FAMILIES = (
    Family("cap", "cap", _cap, 6, _outlines(spherical_cap_exact()), spherical_cap_exact),
    Family("joined_caps", "joined caps", _joined, 6, _outlines(joined_caps_exact()), joined_caps_exact),
    Family("example1", "Example 1", _squares, 7),
    Family("example2", "Example 2", two_caps, 7, lengths=(1.2, 0.8, 0.6, 0.4, 0.3, 0.2, 0.19)),
    Family(
        "example2_near",
        "Example 2, α small 3.2",
        _near,
        6,
        [(ball.centre[0], 0.0, ball.floor_radius) for ball in (LARGE, SMALL)],
    ),
    Family("example3", "Example 3", _fans, 6, [(0.0, 0.0, 20.0)]),
    Family("example4", "Example 4", _hall, 6),
)
TIMES = ["family", "level", "triangles", "seconds", "peak_megabytes"]


def data(folder: Folder, short: bool) -> None:
    """``records``: numbers of each level; ``times``: time and memory, each family by itself."""
    records, times = [], []
    for family in FAMILIES:
        levels = min(3, family.levels) if short else family.levels
        for row in _alone(family.name, levels):
            times.append({key: row[key] for key in TIMES})
            records.append({k: v for k, v in row.items() if k not in TIMES[3:]})
    folder.write_table("records", pd.DataFrame(records))
    folder.write_table("times", pd.DataFrame(times))


def _alone(name: str, levels: int) -> list[dict[str, Any]]:
    """A family in a process of its own, so that its peak of memory is its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(run_family, name, levels).result()


def run_family(name: str, levels: int) -> list[dict[str, Any]]:
    """A row per level: size, how the solver ended, errors, time and memory."""
    family = next(f for f in FAMILIES if f.name == name)
    solve(two_squares(3, alpha_aux=1.0), "newton", target="stationary")  # loads compiled code
    rows: list[dict[str, Any]] = []
    before: Surface | None = None
    for level, (result, seconds) in enumerate(family.solved(levels)):
        here, certificate = result.surface, result.certificate
        row = {
            "family": name,
            "level": level,
            "triangles": here.m,
            "edge_length": _edge_length(here),
            "status": result.status.name.lower(),
            "verdict": certificate.verdict.name.lower(),
            "index": -1 if certificate.index is None else certificate.index,
            "steps": result.iterations,
            "factorisations": int(result.history.factorisation.iloc[-1]),
            "residual": float(np.maximum(certificate.residual, NOISE_RESIDUAL)),
            "quality": certificate.quality,
            "energy": result.energy,
            "height": float(here.plane.height(here.vertices).max()),
            **errors(here),
            "position": float("nan"),
            "moved": _moved(before, here) if before is not None and not family.lengths else np.nan,
            "seconds": seconds,
            "peak_megabytes": peak_bytes() / 1e6,
        }
        if family.exact is not None:
            row["position"] = float(np.sqrt((family.exact().distance(here) ** 2).mean()))
        rows.append(row)
        before = here
    return rows


def _edge_length(surface: Surface) -> float:
    """Of the equilateral triangle with the mean area, length: it halves with each refinement."""
    X, F = surface.vertices, surface.faces
    areas = face_areas(X[F])
    outer = surface.pressures[surface.patch_of_face] != 0.0
    return float(np.sqrt(4.0 / 3.0**0.5 * areas[outer].mean()))


def _moved(coarse: Surface, fine: Surface) -> float:
    """Root mean square of how far the coarse mesh's vertices moved along their normals, length.

    Vertex i of a mesh is vertex i of its refinement.
    """
    X, F = coarse.vertices, coarse.faces
    across = area_vectors(X[F])
    normal = np.zeros_like(X)
    for corner in F.T:
        np.add.at(normal, corner, across)
    inside = coarse.topology.interior & ~coarse.fixed
    normal = normal[inside] / np.linalg.norm(normal[inside], axis=1)[:, None]
    step = fine.vertices[: coarse.n][inside] - X[inside]
    return float(np.sqrt((np.einsum("ij,ij->i", step, normal) ** 2).mean()))


def table(folder: Folder) -> dict[str, float]:
    """``orders``: of each quantity and family; and the paper's claim about Fig. 9."""
    records = folder.read_table("records")
    rows: list[dict[str, Any]] = []
    for family in FAMILIES:
        mine = records[(records.family == family.name) & (records.status == "converged")]
        rows += [
            {"family": family.name, "quantity": quantity, **order.row()}
            for quantity, order in _orders(family, mine).items()
        ]
    orders = pd.DataFrame(rows)
    folder.write_table("orders", orders)
    claim = _claim(records)
    folder.write_table("fig09", claim)
    ok = records[records.status == "converged"]
    found: dict[str, float] = {
        f"{what}_{r['quantity']}_{r['family']}": float(r[what])
        for r in rows
        for what in ("order", "standard_error")
    }
    return found | {
        **{str(key): float(value) for key, value in claim.filter(like="fig9_").iloc[0].items()},
        "largest_variational_error": float(ok.largest_error_variational.max()),
        **{f"largest_mesh_{name}": float(mesh) for name, mesh in _largest(ok).items()},
        "not_converged": float((records.status != "converged").sum()),
    }


def _largest(ok: pd.DataFrame) -> pd.Series[float]:
    """Triangles of each family's largest mesh among those the solver converged on."""
    found: pd.Series[float] = ok.groupby("family").triangles.max()
    return found


def _orders(family: Family, mine: pd.DataFrame) -> dict[str, Order]:
    """The fitted order of each quantity: against the closed form, or against the limit it fits."""
    h = mine.edge_length.to_numpy()
    found = {}
    if family.exact is not None:
        exact = family.exact()
        found["energy"] = slope(h, np.abs(mine.energy.to_numpy() - exact.energy))
        found["height"] = slope(h, np.abs(mine.height.to_numpy() - exact.height))
        found["position"] = slope(h, mine.position.to_numpy())
    else:
        found["energy"] = limit_order(h, mine.energy.to_numpy())
        found["height"] = limit_order(h, mine.height.to_numpy())
        if not family.lengths:
            found["position"] = slope(h[1:], mine.moved.to_numpy()[1:])
    for quantity in ("largest_error_cotangent", "mean_error_cotangent"):
        found[quantity] = slope(h, mine[quantity].to_numpy())
    return found


def _claim(records: pd.DataFrame) -> pd.DataFrame:
    """Fig. 9: "error becomes smaller" with four times as many elements, at Example 1's equilibria.

    A row for each mesh and the next finer one; the paper's are the first two. Beside the corners where
    the wall ends the largest error grows on fine meshes, while the mean goes on falling.
    """
    mine = records[(records.family == "example1") & (records.status == "converged")]
    mine = mine.sort_values("level").reset_index(drop=True)
    pairs = pd.DataFrame(
        {
            "claim": "Fig. 9: four times as many elements, a smaller error",
            "triangles_coarse": mine.triangles,
            "triangles_fine": mine.triangles.shift(-1),
        }
    )
    for key in ("largest", "mean"):
        error = mine[f"{key}_error_cotangent"]
        pairs[f"fig9_{key}_coarse"], pairs[f"fig9_{key}_fine"] = error, error.shift(-1)
        pairs[f"fig9_{key}_ratio"] = error.shift(-1) / error
    pairs = pairs.iloc[:-1].astype({"triangles_fine": int})
    smaller = pairs.fig9_largest_ratio < 1.0, pairs.fig9_mean_ratio < 1.0
    verdicts = ["confirmed", "of the mean only", "of the largest only"]
    which = [smaller[0] & smaller[1], smaller[1], smaller[0]]
    return pairs.assign(verdict=np.select(which, verdicts, "not confirmed"))


def figure(folder: Folder) -> None:
    """Errors against edge length, and time and memory against triangles."""
    from pcmc.plot import convergence, lines

    records, times = folder.read_table("records"), folder.read_table("times")
    curves: dict[str, Any] = {}
    for family in FAMILIES:
        mine = records[(records.family == family.name) & (records.status == "converged")]
        if family.exact is not None:
            exact = family.exact()
            size = exact.height
            apart = (mine.energy - exact.energy).abs() / abs(exact.energy)
            curves[f"{family.title}, energy"] = (mine.edge_length / size, apart)
            curves[f"{family.title}, position"] = (mine.edge_length / size, mine.position / size)
    convergence(
        curves,
        folder.figure("closed-forms"),
        x="edge length / height",
        y="relative error",
        title="closed forms: energy, and mean distance from the exact surface",
    )
    ok = records[records.status == "converged"]
    times = times.merge(ok[["family", "level"]])
    for key in ("largest", "mean"):
        convergence(
            {
                f.title: (mine.edge_length, mine[f"{key}_error_cotangent"])
                for f in FAMILIES
                for mine in [ok[ok.family == f.name]]
            },
            folder.figure(f"{key}-error"),
            y=f"{key} |H - H̄| / H̄, the paper's measure",
            title="what the paper's measure shows at the equilibria",
            fit=key == "mean",
        )
    for key, label, scale in (
        ("seconds", "processor time, s", "log"),
        ("peak_megabytes", "peak memory, MB", "linear"),
    ):
        lines(
            {
                f.title: (mine.triangles, mine[key])
                for f in FAMILIES
                for mine in [times[times.family == f.name]]
            },
            folder.figure(key.replace("_", "-")),
            x="triangles",
            y=label,
            xscale="log",
            yscale=scale,
            markers=True,
        )


STUDY = Study(
    "refinement",
    "orders of convergence, time and memory up to 400 000 triangles; Fig. 9's claim",
    data,
    table,
    figure,
    parameters={f.name: {"levels": f.levels, "edge_lengths": list(f.lengths)} for f in FAMILIES},
    seconds=65,
    paper=False,
    timed=True,
)
