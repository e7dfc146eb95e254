"""The whole surface that a part in front of mirror planes stands for."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, count
from typing import NamedTuple, TypeVar

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import SurfaceError
from ..base.tolerances import ON, PARALLEL
from .guides import Guide, Plane
from .held_curve import HeldCurve
from .images import expect_no_images
from .lagrange import turned_over
from .parts import Cable, Room
from .surface import Surface, expect_surface
from .topology import components, topology

Held = TypeVar("Held", bound=Plane | Guide)  # what holds vertices
MOST_IMAGES = 120  # of the planes through one point no more are possible, but of a prism


class Image(NamedTuple):
    """The isometry x → R x + t."""

    R: Floats
    t: Floats

    def after(self, other: Image) -> Image:
        """First ``other``, then this one."""
        return Image(self.R @ other.R, self.R @ other.t + self.t)


@dataclass(frozen=True, eq=False)
class Whole:
    """The whole surface with where its parts come from; a field is carried over by indexing."""

    surface: Surface
    vertex: Ints  # (n,) the vertex of the piece that each of the whole is an image of
    face: Ints  # (m,) the face
    images: Sequence[Image]  # of the piece, itself first


def mirrored(surface: Surface, planes: Sequence[Plane | str] | None = None) -> Surface:
    """The whole surface; this one is its piece between the mirror planes.

    The vertices in mirror planes are shared by the images; the faces of reflected images are turned over, so
    that each patch keeps its positive side. A patch continues under its name in its images, unless more than
    two of its triangles would meet at an edge, or it bounds a room that is separate from its images: then
    images that do not touch it are numbered, "wall (2)", as are the images of a cable that ends before it.
    Supports, weights, cables and rooms are carried over; a room that a plane cuts has the volume of its parts
    together, and a cable in a mirror plane the tension of its images together.

    Parameters
    ----------
    planes : which mirror planes, or their names; by default all. The others remain mirror planes.

    Raises
    ------
    SurfaceError : no mirror planes; images that overlap, or never end, as between parallel planes.

    >>> from pcmc import Patch
    >>> wall = Plane(normal=(1, 0, 0), mirror=True)
    >>> half = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 1]], [[0, 1, 2]], [0], [Patch("tent", 1.0)], fixed=[1],
    ...                on_planes={wall: [0, 2]})
    >>> whole = mirrored(half)
    >>> whole.vertices.tolist(), whole.faces.tolist()
    ([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [-1.0, 0.0, 0.0]], [[0, 1, 2], [2, 3, 0]])
    """
    return unfolded(surface, planes).surface


def unfolded(surface: Surface, planes: Sequence[Plane | str] | None = None) -> Whole:
    """As ``mirrored``, with the vertex and the face that each of the whole is an image of.

    >>> from pcmc import Patch
    >>> side = Plane(normal=(1, 0, 0), mirror=True, name="x = 0")
    >>> half = Surface([[0, 0, 0], [0, 1, 0], [1, 0, 0]], [[0, 2, 1]], [0], [Patch("film", 1.0)],
    ...                fixed=[2], on_planes={side: [0, 1]})
    >>> unfolded(half).surface.m
    2
    """
    expect_surface(surface)
    expect_no_images(surface, "mirrored")
    mirrors = _chosen(surface, planes)
    masks = np.array([mask for _, mask in mirrors])
    images, next_to = _group([plane for plane, _ in mirrors], surface)
    k, edges, boundary = len(images), surface.topology.edges, surface.topology.boundary_edge
    place = _joined(masks, next_to)
    first = np.unique(place, return_index=True)[1]
    X = np.concatenate([surface.vertices @ R.T + t for R, t in images])[first]
    F = place[:, surface.faces]
    reflected = np.array([np.linalg.det(image.R) < 0.0 for image in images])
    F[reflected] = turned_over(F[reflected], surface.order)
    F = F.reshape(-1, 3)
    # which patch goes on behind which plane, at edges in no other of them
    inside = masks[:, edges].all(axis=2) & boundary
    inside &= inside.sum(axis=0) == 1
    meets = np.zeros((len(mirrors), len(surface.patches)), dtype=bool)
    for row, there in zip(meets, inside, strict=True):
        row[surface.patch_of_face[there[surface.topology.edge_of_face].any(axis=1)]] = True
    label, names = _patches(surface, _joined(meets, next_to), F)
    given, kept = surface.given_supports, [plane for plane, _ in mirrors]
    others = [pair for pair in surface.on_planes if all(pair[0] is not plane for plane in kept)]
    near, none = 1e2 * ON * surface.size, np.zeros(len(X), dtype=bool)
    flat = [(surface.plane, none.copy())]
    _add_images(flat, [(surface.plane, given.on_plane), *others], images, place, near)
    lines: list[tuple[Guide, Bools]] = []
    _add_images(lines, given.on_line, images, place, near)
    fixed = np.sum([none, *(mask for _, mask in lines)], axis=0) > 1
    lines = [(guide, mask & ~fixed) for guide, mask in lines]
    fixed[place[:, given.fixed]] = True
    whole = surface.rebuilt(
        vertices=X,
        faces=F,
        patch_of_face=label[:, surface.patch_of_face].ravel(),
        patches=tuple(replace(surface.patches[p], name=name) for p, name in names),
        fixed=fixed,
        on_plane=flat[0][1],
        on_line=lines,
        on_planes=flat[1:],
        cables=_cables(surface, place, masks, next_to),
        rooms=_rooms(surface, meets, next_to, label, names),
        curves=_curves(surface, images, place),
    )
    return Whole(whole, first % surface.n, np.tile(np.arange(surface.m), k), images)


def _chosen(surface: Surface, planes: Sequence[Plane | str] | None) -> list[tuple[Plane, Bools]]:
    """The mirror planes to unfold at, each with its vertices."""
    mirrors = [(plane, mask) for plane, mask in surface.on_planes if plane.mirror]
    if not mirrors:
        text = "the surface has no mirror plane, so it is whole already;"
        text += " a part of a roof has one: on_planes={Plane(…, mirror=True): vertices}"
        raise SurfaceError(text, what="on_planes")
    if planes is None:
        return mirrors
    chosen = []
    for wanted in planes:
        if isinstance(wanted, str):
            validate.choice("planes", wanted, [plane.name for plane, _ in mirrors])
        hits = [pair for pair in mirrors if wanted in (pair[0].name, pair[0])]
        if not hits:
            known = ", ".join(str(plane) for plane, _ in mirrors)
            text = f"planes: {wanted} is no mirror plane of the surface; it has: {known}"
            raise SurfaceError(text, what="planes", found=str(wanted), expected=known)
        chosen.append(hits[0])
    return chosen


def _group(planes: Sequence[Plane], surface: Surface) -> tuple[list[Image], list[Ints]]:
    """All images of the piece, itself first, and for each plane the number (k,) of each image's reflection.

    Planes whose images never end, or cross the piece, are refused: there the whole would cover itself.
    """
    images, reflections = [Image(np.eye(3), np.zeros(3))], []
    near = 1e2 * ON * surface.size
    for plane in planes:
        normal = np.array(plane.normal)
        R, t = np.eye(3) - 2.0 * np.outer(normal, normal), 2.0 * np.dot(normal, plane.point) * normal
        reflections.append(Image(R, t))
    next_to: list[list[int]] = [[] for _ in planes]
    for image in images:  # which grow meanwhile
        for reflection, numbers in zip(reflections, next_to, strict=True):
            new = image.after(reflection)
            turned = np.array([np.abs(new.R - old.R).max() for old in images])
            shifted = np.array([np.abs(new.t - old.t).max() for old in images])
            same = np.flatnonzero((turned <= PARALLEL) & (shifted <= 1e3 * ON * surface.size))
            numbers.append(int(same[0]) if len(same) else len(images))
            if not len(same):
                images.append(new)
        if len(images) > MOST_IMAGES:
            text = f"the images in the mirror planes never end: {_endless(planes)}"
            raise SurfaceError(text, what="planes", found=len(images))
    for image in images:
        for plane in planes:
            height = plane.mapped(*image).height(surface.vertices)
            if (height > near).any() and (height < -near).any():
                text = f"the images overlap: an image of the {plane} cuts through the surface; mirror planes"
                text += " must meet at 180° over a whole number, with the surface between them"
                raise SurfaceError(text, what="planes", where=str(plane))
    return images, [np.array(numbers) for numbers in next_to]


def _endless(planes: Sequence[Plane]) -> str:
    """Why the images of these planes never end, and what to change."""
    for one, other in combinations(planes, 2):
        normal, second = np.array(one.normal), np.array(other.normal)
        angle = math.degrees(math.atan2(np.linalg.norm(np.cross(normal, second)), abs(normal @ second)))
        nearest = 180.0 / round(180.0 / angle) if angle > 2.0 else angle  # to parallel planes there is none
        if abs(angle - nearest) > math.degrees(PARALLEL):
            text = f"the {one} and the {other} meet at {angle:.9g}°, not at 180° over a whole number such as"
            return f"{text} {nearest:.9g}°; give the ends of the mirrors with all digits"
    text = "some planes are parallel, or nearly, or enclose a prism"
    return f"{text}; name those to unfold at: mirrored(surface, planes=[…])"


def _joined(chosen: Bools, next_to: Sequence[Ints]) -> Ints:
    """(k,q) labels of the k images of q elements: those ``chosen`` (planes, q) are one across their plane."""
    k, q = len(next_to[0]), chosen.shape[1]
    links = [np.empty((2, 0), dtype=np.int64)]
    for parts, other in zip(map(np.flatnonzero, chosen), next_to, strict=True):
        links.append(np.stack([(q * image[:, None] + parts).ravel() for image in (np.arange(k), other)]))
    return components(np.concatenate(links, axis=1).T, k * q).reshape(k, q)


def _add_images(
    found: list[tuple[Held, Bools]],
    pairs: Iterable[tuple[Held, Bools]],
    images: Sequence[Image],
    place: Ints,
    near: float,
) -> None:
    """Add the images of planes or lines, each with the mask of its vertices, to those found already."""
    pairs = list(pairs)
    for image, row in zip(images, place, strict=True):
        for guide, mask in pairs:
            new = guide.mapped(*image)
            same = [there for other, there in found if other.same_as(new, near)]
            if not same and mask.any():
                same.append(np.zeros(int(place.max()) + 1, dtype=bool))
                found.append((new, same[0]))
            if same:
                same[0][row[mask]] = True


def _patches(surface: Surface, label: Ints, F: Ints) -> tuple[Ints, list[tuple[int, str]]]:
    """(images, patches) the patch of the whole; and of each patch there, where it comes from and its name.

    ``label`` (images, patches) are the connected ones.
    """
    k, q = label.shape
    source = np.tile(surface.patch_of_face, k)
    topo = topology(F, source, int(F.max()) + 1)
    key = topo.edge_of_face.astype(np.int64) * q + source[:, None]
    crowded = np.bincount(key.ravel(), minlength=q * len(topo.edges)).reshape(-1, q) > 2
    apart = np.asarray(crowded.any(axis=0) | surface.room_signs.any(axis=0))
    out, names = np.empty((k, q), dtype=np.int64), list[tuple[int, str]]()
    taken = {patch.name for patch in surface.patches}
    for p, patch in enumerate(surface.patches):
        for part in np.unique(label[:, p]) if apart[p] else label[:1, p]:
            name = patch.name if part == label[0, p] else _unused(patch.name, taken)
            out[(label[:, p] == part) | (not apart[p]), p] = len(names)
            names.append((p, name))
    return out, names


def _unused(name: str, taken: set[str]) -> str:
    new = next(f"{name} ({k})" for k in count(2) if f"{name} ({k})" not in taken)
    taken.add(new)
    return new


def _cables(surface: Surface, place: Ints, masks: Bools, next_to: Sequence[Ints]) -> tuple[Cable, ...]:
    """The cables: one goes on behind a plane unless it ends there, held, before it; in a mirror plane the
    tensions of coinciding images add up."""
    goes_on = np.zeros((len(masks), len(surface.cables)), dtype=bool)
    for c, cable in enumerate(surface.cables):
        ends = masks[:, cable.edges]
        free = ends & ~surface.pinned[cable.edges]
        goes_on[:, c] = [f.any() or e.all(axis=1).any() for f, e in zip(free, ends, strict=True)]
    label = _joined(goes_on, next_to)
    cables, taken = list[Cable](), {cable.name for cable in surface.cables}
    for c, cable in enumerate(surface.cables):
        for part in np.unique(label[:, c]):
            edges = np.sort(place[label[:, c] == part][:, cable.edges].reshape(-1, 2), axis=1)
            edges, times = np.unique(edges, axis=0, return_counts=True)
            if times.min() != times.max():
                text = f"cable {cable.name!r} lies in a mirror plane in part; make"
                raise SurfaceError(f"{text} that part a cable of its own", what="cables", where=cable.name)
            name = cable.name if part == label[0, c] else _unused(cable.name, taken)
            cables.append(replace(cable.shared(int(times[0]), edges), name=name))
    return tuple(cables)


def _curves(surface: Surface, images: Sequence[Image], place: Ints) -> tuple[HeldCurve, ...]:
    """The curves with their images, of those in a mirror plane once."""
    chosen = surface.edges_on_curves.drawn
    on, edges = surface.edges_on_curves[chosen], surface.topology.edges[chosen]
    curves, taken = list[HeldCurve](), np.empty((0, 2), dtype=np.int64)
    for image, row in zip(images, place, strict=True):
        ends = row[edges]
        every = np.concatenate([taken, np.sort(ends, axis=1)])
        new = np.unique(every, axis=0, return_index=True)[1]
        new = np.sort(new[new >= len(taken)]) - len(taken)
        curves += [one.mapped(*image) for one in on[new].joined(ends[new])]
        taken = every
    return tuple(curves)


def _rooms(
    surface: Surface, meets: Bools, next_to: Sequence[Ints], patch: Ints, names: Sequence[tuple[int, str]]
) -> tuple[Room, ...]:
    """The rooms: images of one that meet across a plane are one room, with the volume of all; ``patch``
    (images, patches) and ``names`` are those of the whole's patches."""
    label = _joined((meets[:, None, :] & (surface.room_signs != 0.0)).any(axis=2), next_to)
    taken, rooms = {room.name for room in surface.rooms}, []
    for r, room in enumerate(surface.rooms):
        for part in np.unique(label[:, r]):
            images = np.flatnonzero(label[:, r] == part)
            name = room.name if part == label[0, r] else _unused(room.name, taken)
            signs = [(surface.patch_index(of), sign) for of, sign in room.patches]
            patches = {names[patch[image, k]][1]: sign for image in images for k, sign in signs}
            rooms.append(Room(name, tuple(patches.items()), len(images) * room.volume))
    return tuple(rooms)
