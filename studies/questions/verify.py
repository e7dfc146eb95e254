"""A theorem for every example: how near an exact equilibrium is proved to be, the gap, and the cost.

All examples of the paper, the gallery's closed forms, the L-shaped roof of the notebooks, and surfaces with
cables, weight, snow, rooms, mirrors and walls at rest, each on three meshes; and a roof of 30 000 triangles
for the cost beside ``certify``, measured in turns.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd

from generators import spherical_cap, two_squares
from pcmc import Certificate, Surface, Theorem, certify, project, solve, verify
from pcmc.meshing.refinement import refine

from ..benchmarks.timing import median
from ..folder import Folder
from ..forces.cases import CASES
from ..gallery.surfaces import EXAMPLES as GALLERY
from ..study import Study
from .mesh_check import EXAMPLES

ROOF = Path(__file__).parents[2] / "notebooks" / "roof.toml"
MORE: dict[str, Callable[[], Surface]] = {
    "cap under snow": lambda: spherical_cap(0.2).with_snow(0.2),
    "Example 1 at rest on Π, 8 squares": lambda: two_squares(8, alpha_aux=3.0),
}
LEVELS, MOST = 3, 30_000  # meshes of each; triangles beyond which none is refined
COSTLY = 85  # squares a side of Example 1: 31 000 triangles
TURNS = 5


def starts() -> Iterator[tuple[str, str, Callable[[], Surface]]]:
    """Group, name and start of each surface."""
    yield from (("paper", name, build) for name, build in EXAMPLES.items())
    yield from (("gallery", e.name, lambda e=e: e.start(e.edge_length)) for e in GALLERY)
    yield from (("forces", case.name, lambda case=case: case.mesh(0)) for case in CASES)
    yield from (("forces", name, build) for name, build in MORE.items())


def data(folder: Folder, short: bool) -> None:
    """``theorems``, a row for each surface and mesh; ``times`` of both, and ``cost`` on a large roof."""
    rows, times = [], []
    roof = project.load(ROOF)
    begun = [("roof", "L-shaped roof", project.solve_project(roof, project.surface_of(roof)).surface)]
    chosen = [start for k, start in enumerate(starts()) if not short or k % 9 == 0]
    for group, name, surface in [*((g, n, build()) for g, n, build in chosen), *begun]:
        for level in range(1 if short else LEVELS):
            if level:
                if 4 * surface.m > MOST:
                    break
                surface = refine(surface)
            result = solve(surface, target="stationary")
            surface = result.surface
            seconds, certificate, theorem = measured(surface)
            head = {"group": group, "name": name, "level": level, "triangles": surface.m}
            rows.append(
                {
                    **head,
                    "verdict": certificate.verdict.name.lower(),
                    "certified_index": certificate.index,
                    "proved": theorem.proved,
                    "index": theorem.index,
                    **{key: float(f"{getattr(theorem, key):.2e}") for key in NUMBERS},
                    "size": round(surface.size, 6),
                    "reason": theorem.reason,
                }
            )
            times.append({**head, "certify": seconds[0], "verify": seconds[1]})
            if certificate.index is None:
                break
    folder.write_table("theorems", pd.DataFrame(rows))
    folder.write_table("times", pd.DataFrame(times))
    large = solve(two_squares(8 if short else COSTLY, alpha_aux=1.0)).surface
    pairs = [measured(large)[0] for _ in range(1 + TURNS)][1:]
    cost = {
        "triangles": large.m,
        "certify": median(a for a, _ in pairs),
        "verify": median(b for _, b in pairs),
    }
    folder.write_table("cost_times", pd.DataFrame([{**cost, "ratio": cost["verify"] / cost["certify"]}]))


NUMBERS = ("radius", "unique_within", "gap", "beta", "lipschitz", "forces")


def measured(surface: Surface) -> tuple[tuple[float, float], Certificate, Theorem]:
    """Wall time of ``certify`` and of ``verify``, each on a copy that is new to them, and what they find."""
    first, second = (surface.moved(surface.vertices.copy()) for _ in range(2))
    begin = time.perf_counter()
    certificate = certify(first)
    middle = time.perf_counter()
    theorem = verify(second)
    return (middle - begin, time.perf_counter() - middle), certificate, theorem


def table(folder: Folder) -> dict[str, float]:
    """How many surfaces at rest have a theorem, whether the indices agree, and the largest radius."""
    rows = folder.read_table("theorems")
    rest = rows[rows["certified_index"].notna()]
    proved = rest[rest["proved"]]
    return {
        "surfaces": float(len(rows)),
        "at_rest": float(len(rest)),
        "proved": float(len(proved)),
        "proved_not_at_rest": float((rows["proved"] & rows["certified_index"].isna()).sum()),
        "other_index": float((proved["index"] != proved["certified_index"]).sum()),
        "largest_radius_in_sizes": float((proved["radius"] / proved["size"]).max()),
        "median_radius_in_sizes": float((proved["radius"] / proved["size"]).median()),
    }


def figure(folder: Folder) -> None:
    """Radius and gap against the number of triangles, a column for each group."""
    from pcmc.plot.curves import MARKERS
    from pcmc.plot.figure import CURVES, INK, SMALL, TEXT, finish, new, style

    rows = folder.read_table("theorems")
    proved = rows[rows["proved"]].copy()
    proved["radius"] /= proved["size"]
    groups = proved.groupby("group", sort=False)
    picture = new(1200, 760)
    kinds = (("radius", "radius / size of the surface"), ("gap", "gap of the eigenvalues, force/length"))
    panels = picture.subplots(len(kinds), groups.ngroups, sharex=True, sharey="row", squeeze=False)
    for line, (key, label) in zip(panels, kinds, strict=True):
        for k, (axes, (group, part)) in enumerate(zip(line, groups, strict=True)):
            style(axes)
            for _, ladder in part.groupby("name", sort=False):
                axes.plot(
                    ladder["triangles"],
                    ladder[key],
                    color=CURVES[k],
                    marker=MARKERS[k],
                    markersize=3.0,
                    linewidth=0.7,
                    alpha=0.8,
                )
            axes.set(xscale="log", yscale="log")
            if key == "radius":
                axes.set_title(group, fontsize=TEXT, color=INK)
            else:
                axes.set_xlabel("triangles", fontsize=SMALL, color=INK)
        line[0].set_ylabel(label, fontsize=SMALL, color=INK)
    finish(picture, folder.figure("theorems"))


STUDY = Study(
    "verify",
    "a theorem for every example, closed form and roof on three meshes: radius, gap and cost",
    data,
    table,
    figure,
    parameters={"meshes": LEVELS, "most_triangles": MOST, "turns": TURNS},
    seconds=120,
    paper=False,
)
