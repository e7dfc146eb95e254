"""A Surface with walls, from the lines of a plan or from a mesh with labelled faces.

``plan`` holds Plan, ``parts`` dividers, holes, patches and cables; ``build`` makes the Surface from the
``draft`` (``lines``, their ``arrangement``, ``edges``, walls), by ``surface`` and ``meshing``.
``drawing`` reads CAD files (``strokes`` on layers, joined to ``paths``), ``proposal`` chooses what they
do not say. May import ``io`` and the rooms below it.
"""

from ..meshing.labelled import surface_from_labels
from ..meshing.walls import add_walls
from ..surface.curve_data import curve
from ..surface.curves import Curve, arc, bezier, circle, ellipse, join, polyline
from .parts import CableLine, Divider, Hole, PatchSpec
from .plan import Plan, patch_names, plan_from

__all__ = ["CableLine", "Curve", "Divider", "Hole", "PatchSpec", "Plan", "add_walls", "arc", "bezier"]
__all__ += ["circle", "curve", "ellipse", "join", "patch_names", "plan_from", "polyline"]
__all__ += ["surface_from_labels"]
