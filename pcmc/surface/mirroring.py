"""A surface that ends at mirror planes, and the whole that it stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import NamedTuple, TypeVar

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints
from ..base.errors import SurfaceError
from ..curves.plane import Plane
from .cable import Cable
from .circle import Circle, Guide
from .held_curve import HeldCurve
from .line import Line
from .room import Room
from .supports import NEAR
from .surface import Surface, expect_surface
from .topology import components, topology

Held = TypeVar("Held", Plane, Guide)  # what holds vertices
MOST_IMAGES = 120  # of the planes through one point no more are possible, but of a prism
ALIKE = 1e-9  # two matrices or unit vectors this near are the same


class Image(NamedTuple):
    """The isometry x → R x + t."""

    R: Floats
    t: Floats

    def points(self, X: Floats) -> Floats:
        """(…,3) where points (…,3) go."""
        return X @ self.R.T + self.t

    def after(self, other: Image) -> Image:
        """First ``other``, then this one."""
        return Image(self.R @ other.R, self.R @ other.t + self.t)


@dataclass(frozen=True, eq=False)
class Whole:
    """The whole surface with where its parts come from; a field is carried over by indexing.

    Attributes
    ----------
    surface : the whole.
    vertex, face : (n,), (m,) int: the vertex and the face of the piece that each of the whole is an image of.
    images : how often the piece is in the whole.
    """

    surface: Surface
    vertex: Ints
    face: Ints
    images: int


def mirrored(surface: Surface, planes: Sequence[Plane | str] | None = None) -> Surface:
    """The whole surface of which this one is the piece between its mirror planes.

    The vertices in mirror planes are shared by the images; the faces of reflected images are turned over, so
    that each patch keeps its positive side. A patch continues under its name in its images, unless more than
    two of its triangles would meet at an edge, or it bounds a room that is separate from its images: then
    images that do not touch it are numbered, "wall (2)". Supports, weights, cables and rooms are carried
    over; a room that a plane cuts has the volume of its parts together, and a cable in a mirror plane the
    tension of its images together.

    Parameters
    ----------
    planes : which mirror planes, or their names; by default all. The others remain mirror planes.

    Raises
    ------
    SurfaceError
        Without mirror planes, if the images never end, as between parallel planes, or if they overlap.

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
    """As ``mirrored``, with the vertex and the face that each of the whole is an image of."""
    expect_surface(surface)
    mirrors = _chosen(surface, planes)
    generators = [_reflection(plane) for plane, _ in mirrors]
    images, next_to = _group(generators, surface.size)
    _refuse_overlap(surface, mirrors, images)
    n, m, k = surface.n, surface.m, len(images)
    links = [np.empty((2, 0), dtype=np.int64)]
    for (_, mask), other in zip(mirrors, next_to, strict=True):
        there = np.flatnonzero(mask)
        links.append(
            np.stack([(n * np.arange(k)[:, None] + there).ravel(), (n * other[:, None] + there).ravel()])
        )
    place, first = _joined(np.concatenate(links, axis=1), n * k)
    X = np.concatenate([image.points(surface.vertices) for image in images])[first]
    F = place[(surface.faces[None] + n * np.arange(k)[:, None, None])]
    turned = np.array([np.linalg.det(image.R) < 0.0 for image in images])
    F[turned] = F[turned][:, :, ::-1]
    F = F.reshape(-1, 3)
    place = place.reshape(k, n)
    patch_label, patch_names = _patches(surface, mirrors, next_to, F)
    patch = patch_label[:, surface.patch_of_face].ravel()
    patches = tuple(replace(surface.patches[p], name=name) for p, name in patch_names)
    fixed, lines, flat = _supports(surface, mirrors, images, place, len(X))
    whole = surface.rebuilt(
        vertices=X,
        faces=F,
        patch_of_face=patch,
        patches=patches,
        fixed=fixed,
        on_plane=flat[0][1],
        on_line=lines,
        on_planes=flat[1:],
        cables=_cables(surface, place),
        rooms=_rooms(surface, mirrors, next_to, patch_label, [name for _, name in patch_names]),
        curves=_curves(surface, images, place),
    )
    return Whole(whole, first % n, np.tile(np.arange(m), k), k)


def _chosen(surface: Surface, planes: Sequence[Plane | str] | None) -> list[tuple[Plane, Bools]]:
    """The mirror planes to unfold at, each with its vertices."""
    mirrors = [(plane, mask) for plane, mask in surface.on_planes if plane.mirror]
    if not mirrors:
        text = (
            "the surface has no mirror plane, so it is whole already;"
            " a part of a roof has one: on_planes={Plane(…, mirror=True): vertices}"
        )
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


def _reflection(plane: Plane) -> Image:
    normal = np.array(plane.normal)
    return Image(np.eye(3) - 2.0 * np.outer(normal, normal), 2.0 * np.dot(normal, plane.point) * normal)


def _group(generators: Sequence[Image], size: float) -> tuple[list[Image], list[Ints]]:
    """All images of the piece, itself first, and for each generator g the number (k,) of image · g."""
    images = [Image(np.eye(3), np.zeros(3))]
    next_to: list[list[int]] = [[] for _ in generators]
    for number in count():
        if number == len(images):
            break
        for generator, numbers in zip(generators, next_to, strict=True):
            new = images[number].after(generator)
            same = [
                np.abs(new.R - old.R).max() <= ALIKE and np.abs(new.t - old.t).max() <= 1e3 * NEAR * size
                for old in images
            ]
            if not any(same):
                images.append(new)
                same.append(True)
            numbers.append(same.index(True))
        if len(images) > MOST_IMAGES:
            text = (
                "the images in the mirror planes never end: some planes are parallel, or no whole number of"
            )
            text += " images fits around their line; name those to unfold at: mirrored(surface, planes=[…])"
            raise SurfaceError(text, what="planes", found=len(images))
    return images, [np.array(numbers) for numbers in next_to]


def _refuse_overlap(
    surface: Surface, mirrors: Sequence[tuple[Plane, Bools]], images: Sequence[Image]
) -> None:
    """Refuse mirror planes whose images cross the piece: there the whole would cover itself."""
    near = 1e2 * NEAR * surface.size
    for image in images:
        for plane, _ in mirrors:
            height = _moved_plane(plane, image).height(surface.vertices)
            if (height > near).any() and (height < -near).any():
                text = f"the images overlap: an image of the {plane} cuts through the surface; mirror planes"
                text += " must meet at 180° over a whole number, with the surface between them"
                raise SurfaceError(text, what="planes", where=str(plane))


def _moved_plane(plane: Plane, image: Image) -> Plane:
    point, normal = image.points(np.array(plane.point)), image.R @ np.array(plane.normal)
    return replace(plane, point=tuple(point.tolist()), normal=tuple(normal.tolist()))


def _joined(links: Ints, size: int) -> tuple[Ints, Ints]:
    """The new number (size,) of each element where linked ones are one, and the first element of each."""
    number = components(links.T, size)
    return number, np.unique(number, return_index=True)[1]


def _meets(surface: Surface, mirrors: Sequence[tuple[Plane, Bools]]) -> Bools:
    """(planes, patches): whether the patch goes on behind the plane, at edges in no other chosen plane."""
    topo = surface.topology
    inside = np.array([mask[topo.edges].all(axis=1) for _, mask in mirrors]) & topo.boundary_edge
    inside &= inside.sum(axis=0) == 1
    meets = np.zeros((len(mirrors), len(surface.patches)), dtype=bool)
    for row, edges in zip(meets, inside, strict=True):
        row[surface.patch_of_face[edges[topo.edge_of_face].any(axis=1)]] = True
    return meets


def _across(meets: Bools, next_to: Sequence[Ints]) -> Ints:
    """(k,q) labels: which of the k images of each of q parts are one with each other."""
    k, q = len(next_to[0]), meets.shape[1]
    links = [
        np.stack([(q * np.arange(k)[:, None] + parts).ravel(), (q * other[:, None] + parts).ravel()])
        for parts, other in zip(map(np.flatnonzero, meets), next_to, strict=True)
    ]
    return _joined(np.concatenate(links, axis=1), k * q)[0].reshape(k, q)


def _patches(
    surface: Surface, mirrors: Sequence[tuple[Plane, Bools]], next_to: Sequence[Ints], F: Ints
) -> tuple[Ints, list[tuple[int, str]]]:
    """(images, patches) the patch of the whole; and of each patch there, where it comes from and its name."""
    k, q = len(next_to[0]), len(surface.patches)
    label = _across(_meets(surface, mirrors), next_to)
    source = np.tile(surface.patch_of_face, k)
    topo = topology(F, source, int(F.max()) + 1)
    key = topo.edge_of_face.astype(np.int64) * q + source[:, None]
    crowded = np.bincount(key.ravel(), minlength=q * len(topo.edges)).reshape(-1, q) > 2
    apart = np.asarray(crowded.any(axis=0))
    for room in surface.rooms:
        apart[[surface.patch_index(name) for name, _ in room.patches]] = True
    out = np.empty((k, q), dtype=np.int64)
    names: list[tuple[int, str]] = []
    taken = {patch.name for patch in surface.patches}
    for p, patch in enumerate(surface.patches):
        parts = np.unique(label[:, p]) if apart[p] else label[:1, p]
        for part in parts:
            name = patch.name if part == label[0, p] else _unused(patch.name, taken)
            taken.add(name)
            out[(label[:, p] == part) | (not apart[p]), p] = len(names)
            names.append((p, name))
    return out, names


def _unused(name: str, taken: set[str]) -> str:
    return next(f"{name} ({k})" for k in count(2) if f"{name} ({k})" not in taken)


def _supports(
    surface: Surface,
    mirrors: Sequence[tuple[Plane, Bools]],
    images: Sequence[Image],
    place: Ints,
    n: int,
) -> tuple[Bools, tuple[tuple[Guide, Bools], ...], tuple[tuple[Plane, Bools], ...]]:
    """What is fixed, on lines, and on Π and other planes in the whole: all images of the piece's supports.

    Those in the planes unfolded at are none any more.
    """
    given, size = surface.given_supports, surface.size
    fixed = np.zeros(n, dtype=bool)
    fixed[place[:, given.fixed]] = True
    kept = [(surface.plane, given.on_plane)]
    kept += [pair for pair in surface.on_planes if all(pair[0] is not plane for plane, _ in mirrors)]
    planes: list[tuple[Plane, Bools]] = [(surface.plane, np.zeros(n, dtype=bool))]
    lines: list[tuple[Guide, Bools]] = []
    for image, row in zip(images, place, strict=True):
        for plane, mask in kept:
            new = _moved_plane(plane, image)
            _merge(planes, new, row[mask], [_same_plane(old, new, size) for old, _ in planes], n)
        for guide, mask in given.on_line:
            moved = _moved_guide(guide, image)
            _merge(lines, moved, row[mask], [_same_guide(old, moved, size) for old, _ in lines], n)
    if lines:
        double = np.sum([mask for _, mask in lines], axis=0) > 1
        fixed |= double
        lines = [(guide, mask & ~double) for guide, mask in lines]
    return fixed, tuple(lines), tuple(planes)


def _merge(parts: list[tuple[Held, Bools]], new: Held, vertices: Ints, same: list[bool], n: int) -> None:
    """Add the vertices to the part that is the ``same`` plane or line, or as a new part."""
    if not any(same) and len(vertices):
        parts.append((new, np.zeros(n, dtype=bool)))
        same = [*same, True]
    if any(same):
        parts[same.index(True)][1][vertices] = True


def _same_plane(one: Plane, other: Plane, size: float) -> bool:
    parallel = np.linalg.norm(np.cross(one.normal, other.normal)) <= ALIKE
    return bool(parallel and abs(one.height(other.point)) <= 1e2 * NEAR * size) and one.mirror == other.mirror


def _moved_guide(guide: Guide, image: Image) -> Guide:
    if isinstance(guide, Circle):
        centre, normal = image.points(np.array(guide.centre)), image.R @ np.array(guide.normal)
        return Circle(tuple(centre.tolist()), tuple(normal.tolist()), guide.radius)
    point, direction = image.points(np.array(guide.point)), image.R @ np.array(guide.direction)
    return Line(tuple(point.tolist()), tuple(direction.tolist()))


def _same_guide(one: Guide, other: Guide, size: float) -> bool:
    if type(one) is not type(other):
        return False
    near = 1e2 * NEAR * size
    if isinstance(one, Circle) and isinstance(other, Circle):
        parallel = np.linalg.norm(np.cross(one.normal, other.normal)) <= ALIKE
        apart = np.linalg.norm(np.subtract(one.centre, other.centre)) + abs(one.radius - other.radius)
        return bool(parallel and apart <= near)
    assert isinstance(one, Line)
    assert isinstance(other, Line)
    parallel = np.linalg.norm(np.cross(one.direction, other.direction)) <= ALIKE
    return bool(parallel and float(one.distance(np.array(other.point))) <= near)


def _cables(surface: Surface, place: Ints) -> tuple[Cable, ...]:
    """The cables with their images; in a mirror plane the tensions of coinciding images add up."""
    cables = []
    for cable in surface.cables:
        edges = np.sort(place[:, cable.edges].reshape(-1, 2), axis=1)
        edges, times = np.unique(edges, axis=0, return_counts=True)
        if times.min() != times.max():
            text = f"cable {cable.name!r} lies in a mirror plane in part; make that part a cable of its own"
            raise SurfaceError(text, what="cables", where=cable.name)
        cables.append(Cable(cable.name, int(times[0]) * cable.tension, edges))
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
        curves += [one.mapped(image.R, image.t) for one in on[new].joined(ends[new])]
        taken = every
    return tuple(curves)


def _rooms(
    surface: Surface,
    mirrors: Sequence[tuple[Plane, Bools]],
    next_to: Sequence[Ints],
    patch_label: Ints,
    patch_names: Sequence[str],
) -> tuple[Room, ...]:
    """The rooms: images of one that meet across a plane are one room, with the volume of all."""
    if not surface.rooms:
        return ()
    bounds = surface.room_signs != 0.0
    meets = (_meets(surface, mirrors)[:, None, :] & bounds[None]).any(axis=2)
    label = _across(meets, next_to)
    taken, rooms = {room.name for room in surface.rooms}, []
    for r, room in enumerate(surface.rooms):
        for part in np.unique(label[:, r]):
            images = np.flatnonzero(label[:, r] == part)
            name = room.name if part == label[0, r] else _unused(room.name, taken)
            taken.add(name)
            patches = {
                patch_names[patch_label[image, surface.patch_index(patch)]]: sign
                for image in images
                for patch, sign in room.patches
            }
            rooms.append(Room(name, tuple(patches.items()), len(images) * room.volume))
    return tuple(rooms)
