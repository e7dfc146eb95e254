"""Curves as objects: lines, arcs, ellipses, Béziers; the ``pieces`` they are made of; plain data; planes.

Gives Curve and what makes one to surfaces, plans, drawings and projects. Imports only ``base``.
"""

from .curve_data import curve
from .curves import Curve, arc, bezier, circle, ellipse, join, polyline

__all__ = ["Curve", "arc", "bezier", "circle", "curve", "ellipse", "join", "polyline"]
