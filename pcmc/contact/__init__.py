"""Walls that pinch: where a junction comes down to Π, its wall has no height left and it rests there.

Gives the walls and the part of a surface that stands. Imports ``energy`` and the rooms below it.
"""
