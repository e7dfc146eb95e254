"""Triangles: their quality, redistribution along the shape, refinement and remeshing.

Gives these to plans, solvers and the certificate. Imports ``contact`` and the rooms below it.
"""
