"""The examples whose junctions end on the outline, for the study of these ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from generators import bezier_hall, four_fans, joined_caps, three_patches, two_caps, two_squares
from pcmc import Surface
from pcmc.base.arrays import Floats

from ..questions.refinement import FAMILIES

BOTTOMS = ("sliding", "held")  # of the walls
DRAWN = "fig4"


@dataclass(frozen=True)
class Case:
    """An example whose junctions end on the outline.

    Attributes
    ----------
    build : its initial shape.
    project : puts new boundary vertices on a curved outline.
    """

    name: str
    title: str
    build: Callable[[], Surface]
    project: Callable[[Floats], Floats] | None = None


def _on_rim(radius: float) -> Callable[[Floats], Floats]:
    def project(points: Floats) -> Floats:
        return points * [1.0, 1.0, 0.0] * radius / np.linalg.norm(points[:, :2], axis=1)[:, None]

    return project


ROUND = {family.name: family.rounded for family in FAMILIES}
CASES = (
    Case("example1-0.5", "Example 1, wall 0.5", lambda: two_squares(8, alpha_aux=0.5)),
    Case("example1-1", "Example 1, wall 1", lambda: two_squares(8, alpha_aux=1.0)),
    Case("example1-2", "Example 1, wall 2", lambda: two_squares(8)),
    Case("example2", "Example 2", lambda: two_caps(0.6), ROUND["example2_near"]),
    Case("joined", "two spheres in balance", lambda: joined_caps(0.6), ROUND["joined_caps"]),
    Case("example3", "Example 3", lambda: four_fans(7), _on_rim(20.0)),
    Case("example4", "Example 4", bezier_hall),
    Case("fig4", "Fig. 4", lambda: three_patches(7), _on_rim(10.0)),
)
