"""Curves as objects: lines, arcs, ellipses and Béziers; the ``pieces`` they are made of; their plain data.

Gives Curve and what makes one to plans, drawings and projects. Imports ``surface`` and the rooms below it.
"""

from .curves import Curve, arc, bezier, circle, curve, ellipse, join, polyline

__all__ = ["Curve", "arc", "bezier", "circle", "curve", "ellipse", "join", "polyline"]
