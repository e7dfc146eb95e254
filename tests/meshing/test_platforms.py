"""Roofs along curved platforms, remeshed: those that exist come to rest, and a collapse has its reason."""

import numpy as np
import pytest

from pcmc import Verdict, solve
from pcmc.meshing.quality import triangle_quality
from pcmc.meshing.remeshing import remesh
from pcmc.plan import Divider, Plan
from pcmc.surface.curves import arc, join, polyline


def at(radius, degrees):
    angle = np.radians(degrees)
    return [float(radius * np.cos(angle)), float(radius * np.sin(angle))]


def platform(radius, width, opening, walls, *, alpha, wall, h, turn=0.0, bottom="sliding"):
    """A strip between two arcs, walls across it at angles from its start, each turned further out."""
    end, outer = opening / 2.0, radius + width
    outline = join(
        arc(at(outer, -end), at(outer, 0.0), at(outer, end)),
        polyline([at(outer, end), at(radius, end)]),
        arc(at(radius, end), at(radius, 0.0), at(radius, -end)),
        polyline([at(radius, -end), at(outer, -end)]),
    )
    across = [
        Divider([at(radius - 1, w - end), at(outer + 1, w - end + turn)], wall=wall, bottom=bottom)
        for w in walls
    ]
    return Plan(outline, across, edge_length=h, tension=alpha).surface()


@pytest.mark.nightly
def test_a_remeshed_roof_is_at_rest_as_it_is_seen():
    """A foot comes to stand right below a resting crest vertex, from where it had hung apart."""
    coarse = solve(platform(15, 6, 100, (50,), alpha=3.6, wall=2.88, h=1.9, turn=7.0))
    assert coarse.certificate.verdict is Verdict.STABLE
    fine = solve(remesh(coarse.surface, 0.7))
    assert fine.converged
    assert len(fine.certificate.pinched)
    assert fine.certificate.residual < 1e-9
    assert fine.certificate.verdict is Verdict.STABLE


def test_a_roof_at_rest_keeps_its_shape_when_remeshed():
    start = platform(30, 8, 60, (20, 40), alpha=6.0, wall=2.0, h=1.6)
    coarse, fine = solve(start), solve(remesh(start, 0.8))
    assert fine.certificate.verdict is coarse.certificate.verdict is Verdict.STABLE
    again = solve(remesh(coarse.surface, 0.8))
    assert again.energy == pytest.approx(fine.energy, rel=2e-3)
    assert again.certificate.verdict is Verdict.STABLE


@pytest.mark.nightly
def test_a_collapse_is_told_with_its_cause():
    """Seen away from the corners, where the mesh has no fixed vertex."""
    start = platform(15, 5, 60, (23, 43), alpha=3.0, wall=2.4, h=2.5, turn=8.0)
    assert solve(start).certificate.verdict is Verdict.STABLE
    fine = remesh(start, 0.8)
    assert triangle_quality(fine.vertices, fine.faces).min() > 0.3
    found = solve(fine).certificate
    assert found.verdict is Verdict.DEGENERATE
    assert "slips along a support, which does not hold its end: hold the bottom of its wall" in found.detail


def test_a_junction_comes_to_rest_on_the_held_bottom_of_a_remeshed_wall():
    start = platform(20, 5, 60, (31,), alpha=4.0, wall=3.2, h=2.0, bottom="held")
    assert solve(start).certificate.verdict is Verdict.STABLE
    found = solve(remesh(start, 0.8)).certificate
    assert found.verdict is Verdict.STABLE
    assert found.residual < 1e-9
    assert len(found.pinched)
