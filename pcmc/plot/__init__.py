"""Pictures of surfaces (pyvista or matplotlib) and of curves; needs the extra ``plot``, no display.

With a path every function writes a picture; each returns it as an (h,w,3) array of bytes.
"""

from .curves import convergence, diagram, heatmap, histories, lines
from .pictures import draw, families, panel, panel_planarity, reactions, vectors
from .uses import equilibria, member_forces, strains, under_load

__all__ = ["convergence", "diagram", "draw", "equilibria", "families", "heatmap", "histories", "lines"]
__all__ += ["member_forces", "panel", "panel_planarity", "reactions", "strains", "under_load", "vectors"]
