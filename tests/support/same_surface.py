"""Two surfaces with the same arrays and names."""

from __future__ import annotations

import numpy as np

import pcmc


def assert_same(one: pcmc.Surface, two: pcmc.Surface) -> None:
    for name in ("vertices", "faces", "patch_of_face", "fixed", "on_plane"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), name)
    assert one.patches == two.patches
    assert one.plane == two.plane
    assert one.rooms == two.rooms
    assert [(c.name, c.tension, c.edges.tolist()) for c in one.cables] == [
        (c.name, c.tension, c.edges.tolist()) for c in two.cables
    ]
    assert [plane for plane, _ in one.on_planes] == [plane for plane, _ in two.on_planes]
    for (_, first), (_, second) in zip(one.on_planes, two.on_planes, strict=True):
        np.testing.assert_array_equal(first, second)
    assert [guide for guide, _ in one.on_line] == [guide for guide, _ in two.on_line]
    for (_, first), (_, second) in zip(one.on_line, two.on_line, strict=True):
        np.testing.assert_array_equal(first, second)
