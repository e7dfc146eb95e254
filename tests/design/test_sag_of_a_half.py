"""A cable that goes on behind a mirror plane sags as the whole cable does."""

import numpy as np
import pytest
from refusals import refused

import pcmc
from pcmc import Parameter, Target
from pcmc.base.errors import OptionError
from pcmc.certificate.cables import too_long
from pcmc.certificate.quantities import figures
from pcmc.design.targets import measure
from pcmc.plan import Plan

SAG = Target("sag", "cable 1", 0.7)
KEYS = {"edge": "cable", "cable": 9.0, "edge_length": 1.0, "tension": 1.0, "pressure": 0.0, "weight": 0.02}


def sail(**changed):
    supports = [[0, 0, 1.5], [8, 0, 1.5], [8, 6, 0], [0, 6, 0]]
    return Plan([[0, 0], [8, 0], [8, 6], [0, 6]], supports=supports, **KEYS | changed).surface()


def half(**changed):
    supports, mirrors = [[0, 0, 1.5], [0, 6, 0]], [[[4, 0], [4, 6]]]
    outline = [[0, 0], [4, 0], [4, 6], [0, 6]]
    return Plan(outline, supports=supports, mirrors=mirrors, **KEYS | changed).surface()


def sags(surface):
    return {f.of: f.value for f in figures(surface, pcmc.certify(surface)) if f.quantity == "sag"}


def test_the_half_has_the_sags_of_the_whole():
    piece = pcmc.solve(half()).surface
    whole, unfolded = sags(pcmc.solve(sail()).surface), sags(pcmc.mirrored(piece))
    found = sags(piece)
    assert found["cable 1"] == pytest.approx(unfolded["cable 1"], rel=1e-12)
    assert found["cable 1"] == pytest.approx(whole["cable 1"], rel=5e-3)
    assert found["cable 3"] == pytest.approx(whole["cable 4"], rel=5e-3)  # beside no mirror


def test_the_same_tension_gives_a_sag_of_the_half_and_of_the_whole():
    vary = Parameter("cable 1", "cable")
    designs = [pcmc.meet(pcmc.solve(start).surface, SAG, vary) for start in (half(), sail())]
    assert all(design.met for design in designs)
    piece, whole = (design.parameters["value"].iloc[0] for design in designs)
    assert piece == pytest.approx(whole, rel=5e-3)


def test_the_derivative_by_positions_is_exact():
    surface = pcmc.solve(half()).surface
    direction, step = np.random.default_rng(5).normal(size=(surface.n, 3)), 1e-6
    direction[surface.on_planes[0][1], 0] = 0.0  # the mirror is at x = 4
    slope = float((measure(surface, SAG).by_position * direction).sum())
    ends = [measure(surface.moved(surface.vertices + s * step * direction), SAG).value for s in (1, -1)]
    assert slope == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-5)


def test_a_cable_between_two_mirrors_has_no_chord_and_a_long_one_is_found_in_the_half():
    outline, mirrors = [[0, 0], [4, 0], [4, 6], [0, 6]], [[[4, 0], [4, 6]], [[0, 0], [0, 6]]]
    cables = [{"curve": [[0, 0], [4, 0]], "tension": 5.0}]
    strip = Plan(
        outline, mirrors=mirrors, cables=cables, edge_length=1.0, tension=1.0, pressure=0.0
    ).surface()
    with refused(OptionError, what="of"):
        measure(strip, Target("sag", "cable 1"))
    assert too_long(half(cable=3.5, weight=0.0)).startswith("cable 'cable 1' spans 8, more than")
    assert not too_long(half(cable=4.5, weight=0.0))
