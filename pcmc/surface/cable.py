"""A cable: edges of a surface that carry a line tension."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..base import validate
from ..base.arrays import Floats, Ints, read_only
from ..base.errors import SurfaceError
from ..base.validate import checked_name
from . import checks


@dataclass(frozen=True, eq=False)
class Cable:
    """A curve of edges with one line tension: E gains τ · length.

    Parameters
    ----------
    name : unique in its surface; 1 to 100 printable characters, no blank at either end.
    tension : τ ≥ 0, force. A free edge of a flat membrane with tension α is at rest on arcs of radius τ/α.
    edges : (k,2) int, the vertices that each edge joins, in any order.

    >>> Cable("east", 2.0, [[4, 3], [4, 5]]).edges.tolist()
    [[3, 4], [4, 5]]
    """

    name: str
    tension: float
    edges: Ints

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", checked_name("Cable.name", self.name, error=SurfaceError))
        number = validate.number(
            "tension", self.tension, least=0.0, most=checks.LARGEST, where=self.name, error=SurfaceError
        )
        object.__setattr__(self, "tension", number)
        edges = checks.edge_array(self.edges, f"cable {self.name!r}")
        object.__setattr__(self, "edges", read_only(edges))

    @classmethod
    def along(cls, name: str, tension: float, vertices: npt.ArrayLike, closed: bool = False) -> Cable:
        """The cable through a sequence of vertices (k,), each joined to the next.

        >>> Cable.along("ring", 1.0, [2, 0, 1], closed=True).edges.tolist()
        [[0, 1], [0, 2], [1, 2]]
        """
        chain: Sequence[int] = np.asarray(vertices).tolist()
        following = [*chain[1:], chain[0]] if closed else chain[1:]
        return cls(name, tension, np.array(list(zip(chain, following, strict=False))))

    def carried(self, number: Ints) -> Cable | None:
        """The cable on the vertices that have these numbers (n,) now; None where no edge of it is left.

        >>> Cable("a", 1.0, [[0, 1], [1, 2]]).carried(np.array([5, 5, 3])).edges.tolist()
        [[3, 5]]
        """
        ends = number[self.edges]
        ends = np.unique(np.sort(ends[ends[:, 0] != ends[:, 1]], axis=1), axis=0)
        return Cable(self.name, self.tension, ends) if len(ends) else None

    def cut(self, ends: Ints, number: Ints) -> Cable:
        """The cable with the vertices ``number`` (k,) on those of its edges that are among ``ends`` (k,2).

        >>> Cable("a", 1.0, [[0, 1], [1, 2]]).cut(np.array([[0, 1]]), np.array([7])).edges.tolist()
        [[0, 7], [1, 2], [1, 7]]
        """
        weights = np.array([1 + max(int(ends.max(initial=0)), int(self.edges.max())), 1])
        keys, own = np.sort(ends, axis=1).astype(np.int64) @ weights, self.edges.astype(np.int64) @ weights
        order = np.argsort(keys)
        place = np.minimum(np.searchsorted(keys, own, sorter=order), len(keys) - 1)
        cut = keys[order[place]] == own if len(keys) else np.zeros(len(own), dtype=bool)
        middle, old = number[order[place[cut]]], self.edges[cut]
        halves = [np.stack([old[:, k], middle], axis=1) for k in (0, 1)]
        return Cable(self.name, self.tension, np.concatenate([self.edges[~cut], *halves]))


class CableEdges(NamedTuple):
    """The edges of a surface that pull: ``ends`` (c,2) int, and the ``tension`` (c,) of each, force."""

    ends: Ints
    tension: Floats


def cable_edges(cables: Sequence[Cable]) -> CableEdges:
    """The edges of all cables whose tension is not 0.

    >>> cable_edges([Cable("a", 2.0, [[0, 1], [1, 2]]), Cable("b", 0.0, [[2, 3]])]).tension.tolist()
    [2.0, 2.0]
    """
    pulling = [cable for cable in cables if cable.tension > 0.0]
    ends = np.concatenate([np.empty((0, 2), dtype=np.int32), *(cable.edges for cable in pulling)])
    tension = np.repeat([cable.tension for cable in pulling], [len(cable.edges) for cable in pulling])
    return CableEdges(read_only(ends), read_only(tension.astype(float)))


def checked_cables(given: Any, edges: Ints, n: int) -> tuple[Cable, ...]:
    """Cables of unique names on edges (e,2) of a mesh with n vertices, no edge in two of them."""
    parts = tuple(given) if isinstance(given, Iterable) else (None,)
    if not all(isinstance(part, Cable) for part in parts):
        validate.refuse("cables", given, "a sequence of Cable", error=SurfaceError)
    checks.unique_names("cables", [cable.name for cable in parts])
    there = np.sort(edges.astype(np.int64) @ np.array([n, 1]))
    taken = np.empty(0, dtype=np.int64)
    for cable in parts:
        keys = cable.edges.astype(np.int64) @ np.array([n, 1])
        bad = np.flatnonzero(
            ~np.isin(keys, there) | (cable.edges < 0).any(axis=1) | (cable.edges >= n).any(axis=1)
        )
        what = f"cable {cable.name!r}: edges"
        if len(bad):
            fault = "joins vertices that no edge of the mesh joins"
            checks.refuse_rows(what, cable.edges, bad, fault, hint="name the two ends of an edge")
        bad = np.flatnonzero(np.isin(keys, taken))
        if len(bad):
            hint = "make it one cable with the sum of their tensions"
            checks.refuse_rows(what, cable.edges, bad, "carries another cable, too", hint=hint)
        taken = np.append(taken, keys)
    return parts
