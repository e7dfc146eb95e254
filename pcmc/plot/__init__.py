"""Pictures of surfaces (pyvista) and of curves (matplotlib); needs the extra ``plot``, no display.

Every function writes a PNG when given a path, and returns the picture as an (h,w,3) array of bytes.
"""

from .curves import convergence, heatmap, histories, lines
from .diagrams import diagram
from .pictures import draw, panel, vectors
from .supports import reactions

__all__ = [
    "convergence",
    "diagram",
    "draw",
    "heatmap",
    "histories",
    "lines",
    "panel",
    "reactions",
    "vectors",
]
