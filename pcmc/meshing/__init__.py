"""Triangles: of a plane domain, walls of a mesh, their quality, redistribution, refinement and remeshing.

Gives these to plans, solvers and the certificate. Imports ``forces`` and the rooms below it.
"""
