"""What in a mesh from another program is probably not meant: open seams, patches turned against each other,
an axis that is up elsewhere. Such a mesh can be solved all the same, and gives another roof than the one
drawn.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..base.arrays import Floats, Ints
from ..surface.geometry import area_vectors, segment_lengths
from .contents import Contents

GAP = 0.05  # of the boundary edges beside it: nearer vertices are one that was drawn twice
LOOKS = 0.5  # part of the area that looks one way: a roof, and not a column or a ball
LEVEL = 1e-2  # of that: what may look up in a roof whose up is another axis


def suspicions(contents: Contents) -> tuple[str, ...]:
    """A sentence for each thing that is probably not meant; none where a format told of supports.

    >>> from pcmc import Patch
    >>> X = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    >>> pair = Contents(X, np.array([[0, 1, 2], [0, 3, 2]]), np.array([0, 1]), (Patch("a", 1), Patch("b", 1)))
    >>> suspicions(pair)[0].split(":")[0]
    "patches 'a' and 'b' are turned against each other"
    """
    if contents.support is not None or not len(contents.faces):
        return ()
    found = (_open_seams(contents), _against(contents), _lying(contents))
    return tuple(filter(None, found))


def _directed(contents: Contents) -> tuple[Ints, Ints]:
    """(3m,2) the edges of all faces as they run, and (3m,) the number of the edge that each is."""
    F = contents.faces
    run = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    number = np.unique(np.sort(run, axis=1), axis=0, return_inverse=True)[1]
    return run, number.ravel()


def _open_seams(contents: Contents) -> str:
    run, number = _directed(contents)
    outer = run[(np.bincount(number) == 1)[number]]
    if not len(outer):
        return ""
    X: Floats = contents.vertices
    length = segment_lengths(X, outer)
    beside = np.full(len(X), np.inf)
    np.minimum.at(beside, outer.ravel(), np.repeat(length, 2))
    rim = np.unique(outer)
    found = cKDTree(X[rim]).query(X[rim], k=2)
    apart, near = np.asarray(found[0])[:, 1], np.asarray(found[1])[:, 1]
    close = apart < GAP * np.minimum(beside[rim], beside[rim[near]])
    if not close.any():
        return ""
    place = X[rim[close][0]].round(4).tolist()
    return (
        f"{np.count_nonzero(close)} vertices on its boundary are at most {apart[close].max():.2g}"
        f" from another there, the first at {place}, and not joined: a seam is open; join them where it"
        " was drawn"
    )


def _against(contents: Contents) -> str:
    run, number = _directed(contents)
    patch = np.tile(contents.patch_of_face, 3)
    order = np.argsort(number, kind="stable")
    pairs = order[(np.bincount(number) == 2)[number[order]]].reshape(-1, 2)
    one, two = pairs.T
    wrong = (patch[one] != patch[two]) & (run[one] == run[two]).all(axis=1)
    if not wrong.any():
        return ""
    first = np.flatnonzero(wrong)[0]
    a, b = (contents.patches[patch[k]].name for k in sorted((one[first], two[first])))
    return (
        f"patches {a!r} and {b!r} are turned against each other: their pressures act to opposite"
        " sides; reverse the faces of one, if that is not meant"
    )


def _lying(contents: Contents) -> str:
    vector = area_vectors(contents.vertices[contents.faces])
    total = np.abs(vector.sum(axis=0))
    size = float(np.linalg.norm(total))
    if size < LOOKS * float(np.linalg.norm(vector, axis=1).sum()) or total[2] > LEVEL * size:
        return ""
    axis = "xy"[int(total[:2].argmax())]
    return f"it looks along {axis} and not up, which is z here; turn it, if {axis} is up in it"
