"""‖∇E‖² of each family of meshes beside the value that the paper prints for its initial shapes.

The paper does not publish its meshes, and ‖∇E‖² of the same shape falls with the size of the triangles.
So each family of an example is tried at each resolution of a fixed list; nothing else varies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

from pcmc import Surface, gradient
from pcmc.base import validate

from .bezier_hall import bezier_hall
from .fans import four_fans
from .two_caps import two_caps

PRINTED = {"example2": 12.204, "example3": 7893.633, "example4": 2.678e5}  # Secs. 4.2, 4.3, 4.4

EDGES_2 = (1.2, 1.1, 1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.45, 0.4, 0.38, 0.36, 0.34, 0.3, 0.2, 0.15)
RINGS_3 = tuple(range(4, 17))
EDGES_4 = (8.0, 7.0, 6.0, 5.0, 4.6, 4.2, 4.0, 3.9, 3.8, 3.7, 3.6, 3.5, 3.4, 3.2, 3.0)


@dataclass(frozen=True)
class Candidate:
    """One mesh of the search.

    Attributes
    ----------
    example, family : which example, and which kind of initial mesh.
    parameter, resolution : the generator's parameter that sets the resolution, and its value.
    triangles : how many the mesh has.
    squared_gradient : ‖∇E‖² of the initial shape at the paper's tensions, force².
    printed : the paper's value.
    """

    example: str
    family: str
    parameter: str
    resolution: float
    triangles: int
    squared_gradient: float
    printed: float

    @property
    def ratio(self) -> float:
        """Squared gradient / printed."""
        return self.squared_gradient / self.printed


def candidates(examples: Iterable[str] = tuple(PRINTED)) -> Iterator[Candidate]:
    """Every family of the given examples at every resolution of the list.

    >>> first = next(candidates(["example3"]))
    >>> first.family, first.parameter, first.resolution, first.printed
    ('soap film, rings', 'rings', 4, 7893.633)
    """
    for example in examples:
        validate.choice("example", example, tuple(PRINTED))
        for family, parameter, resolutions, build in _families(example):
            for resolution in resolutions:
                surface = build(resolution)
                squared = float((gradient(surface) ** 2).sum())
                yield Candidate(
                    example, family, parameter, resolution, surface.m, squared, PRINTED[example]
                )


def nearest(tried: Iterable[Candidate]) -> list[Candidate]:
    """The candidate of each family whose ratio is nearest to 1, in the order of the families.

    >>> near, far = (Candidate("e", "f", "n", n, 9, g, 8.0) for n, g in ((1, 9.0), (2, 2.0)))
    >>> [candidate.resolution for candidate in nearest([far, near])]
    [1]
    """
    best: dict[tuple[str, str], Candidate] = {}
    for one in tried:
        key = (one.example, one.family)
        if key not in best or _distance(one) < _distance(best[key]):
            best[key] = one
    return list(best.values())


def _distance(candidate: Candidate) -> float:
    return abs(candidate.ratio - 1.0)


_Family = tuple[str, str, tuple[float, ...], Callable[[float], Surface]]


def _families(example: str) -> Iterator[_Family]:
    if example == "example2":
        for wall in ("upright", "inclined"):
            yield f"{wall} wall", "edge_length", EDGES_2, partial(two_caps, wall=wall)
    elif example == "example3":
        for start, bulge in (("soap film", None), ("cone", 0.0)):
            for mesh in ("rings", "even", "double", "lattice"):
                build = partial(four_fans, bulge=bulge, mesh=mesh)
                yield f"{start}, {mesh}", "rings", RINGS_3, build
    elif example == "example4":
        yield "lattice", "edge_length", EDGES_4, bezier_hall
