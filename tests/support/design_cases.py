"""Surfaces that targets are tried on, and differences to hold their derivatives against."""

import functools
import tomllib

import numpy as np

import pcmc
from generators import spherical_cap
from pcmc.design.targets import measure
from pcmc.plan import plan_from

TIGHT = {"tolerance": 1e-13, "min_quality": 0.0}

ROOF = """
edge_length = 2.0
outline = [[0, 0], [24, 0], [24, 10], [10, 10], [10, 24], [0, 24]]
holes = [{curve = {circle = {centre = [17, 5], radius = 2.0}}}]
dividers = [
  {curve = [[7.5, 7.5], [10, 10]], wall = 3.0, bottom = "held"},
  {curve = [[7.5, 7.5], [0, 9.5096189432]], wall = 3.0, bottom = "held"},
  {curve = [[7.5, 7.5], [9.5096189432, 0]], wall = 3.0, bottom = "held"},
]
[patches]
corner = {tension = 6.0, at = [3, 3]}
north = {tension = 6.0, at = [5, 20]}
east = {tension = 6.0, at = [20, 8]}
"""


@functools.cache
def roof_at_rest():
    """Three patches over an L with a courtyard, at rest."""
    return pcmc.solve(plan_from(tomllib.loads(ROOF)).surface(), **TIGHT).surface


def cap(**arguments):
    return spherical_cap(0.35, alpha=1.5, **arguments)


def changed(surface, parameter, value):
    given = {parameter.patch: value}
    tension = parameter.kind == "tension"
    return surface.retensioned(given if tension else None, None if tension else given)


def difference(surface, targets, parameter, step, **options):
    """Central difference of the quantities of re-solved surfaces, with one Richardson step."""

    def at(change):
        value = parameter.value(surface) * (1.0 + change)
        solved = pcmc.solve(changed(surface, parameter, value), **TIGHT, **options).surface
        return np.array([measure(solved, t).value for t in targets])

    one, two = ((at(h) - at(-h)) / (2 * h) for h in (step, 2 * step))
    return (4 * one - two) / 3 / parameter.value(surface)
