"""Surfaces with rooms of prescribed volume."""

from dataclasses import replace

import numpy as np
from shapes import pyramid

import generators
from pcmc import Patch, Plane, Room, Surface
from pcmc.forces.rooms import room_volumes

DOUBLE, TRIPLE = 9.139421678069, 13.128168244433  # least areas around volumes of 1


def cap(volume: float, edge_length: float = 0.25, **arguments) -> Surface:
    """A cap over the unit disc, with its volume prescribed."""
    surface = generators.spherical_cap(edge_length, **arguments)
    return replace(surface, rooms=[Room("room", {"cap": 1}, volume)])


def cap_height(volume: float) -> float:
    """h of the cap over the unit disc: V = π h (3 + h²) / 6."""
    return float(np.roots([1.0, 0.0, 3.0, -6.0 * volume / np.pi]).real.max())


def raised(height: float = 0.5) -> Surface:
    """A pyramid over a square whose fixed boundary lies at a height over Π."""
    roof = pyramid(rooms=[Room("room", {"roof": 1}, 2.0)])
    return replace(roof, vertices=roof.vertices + height * np.eye(3)[2])


def connected_caps(volume: float, edge: float = 0.34) -> Surface:
    """Two caps over unit discs apart from each other, with one pressure and one volume together."""
    one = generators.spherical_cap(edge, height=1.3)
    aside = 2.5 * np.eye(3)[0]
    X = np.concatenate([one.vertices - aside, one.vertices + aside])
    F = np.concatenate([one.faces, one.faces + one.n])
    patches = [Patch("left", 1.0), Patch("right", 1.0)]
    room = Room("both", {"left": 1, "right": 1}, volume)
    return Surface(X, F, np.repeat([0, 1], one.m), patches, np.tile(one.fixed, 2), rooms=[room])


def cylinder(edge_length: float, length: float, between: str) -> Surface:
    """A cylinder of the volume that it has, between fixed rings or plates that its ends slide on."""
    surface = generators.cylinder(edge_length, length=length, exact=True)
    rooms = [Room("inside", {"tube": 1}, 1.0)]
    if between == "rings":
        surface = replace(surface, rooms=rooms)
    else:
        lid = Plane((0.0, 0.0, length), (0.0, 0.0, 1.0), "lid")
        low, high = np.isclose(surface.vertices[:, 2], 0.0), np.isclose(surface.vertices[:, 2], length)
        mesh = surface.vertices, surface.faces, surface.patch_of_face, surface.patches
        surface = Surface(*mesh, on_plane=low, on_planes={lid: high}, rooms=rooms)
    return surface.retensioned(volumes={"inside": room_volumes(surface)[0]})
