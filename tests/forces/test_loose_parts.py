"""Loose parts, islands of patches, weak patches: each is at rest by itself, or the surface is not."""

import numpy as np
import pytest
from shapes import cap, pyramid

from pcmc import Patch, Surface, Verdict, certify, solve


def beside_a_stiff_roof(strength, soft="soft"):
    """A pyramid that is far from rest, joined along a held edge to one that is at rest and pulls more."""
    X = np.concatenate([pyramid().vertices, pyramid(height=8**-0.5).vertices[[1, 4]] - [2, 0, 0]])
    X = np.concatenate([X, [[-3, -1, 0]]])
    F = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 5, 6], [5, 7, 6], [7, 2, 6], [2, 1, 6]]
    patches = [Patch("soft", 1.0), Patch("stiff", strength, strength)]
    return Surface(X, F, [0] * 4 + [1] * 4, patches, fixed=[0, 1, 2, 3, 5, 7])


def test_strong_forces_do_not_hide_what_a_weak_patch_lacks():
    """Where they are joined, here along a held line; loose parts are measured each by itself."""
    joined = beside_a_stiff_roof(1e10)
    found = certify(joined)
    assert found.residual < 1e-8
    assert found.curvature_error > 0.1
    assert found.verdict is Verdict.NOT_CONVERGED
    assert found.detail.startswith("the forces left in patch 'soft', or in an island of it, are 4.7e-01")
    assert solve(joined, tolerance=1e-18).certificate.verdict is Verdict.STABLE


def loose(size, strength, *, one_patch=False):
    """A cap at rest, and far from it another, of other size and tension, that is not."""
    at_rest, other = solve(cap(2)).surface, cap(2)
    X = np.concatenate([at_rest.vertices, size * other.vertices * [1.0, 1.0, 1.3] + [3.0, 0.0, 0.0]])
    F = np.concatenate([other.faces, other.faces + other.n])
    patches = [Patch("cap", 0.6), Patch("other", 0.6 * strength, strength / size)][: 1 if one_patch else 2]
    fixed = np.concatenate([other.fixed, other.fixed])
    return Surface(X, F, np.repeat([0, 0 if one_patch else 1], other.m), patches, fixed=fixed)


LOOSE = [(1.0, 1.0), (1e-6, 1.0), (1.0, 1e-14), (1.0, 1e-30), (1e-6, 1e-14), (1e6, 1e-20)]


@pytest.mark.parametrize(("size", "strength"), LOOSE)
def test_each_loose_part_is_judged_and_solved_by_itself(size, strength):
    start = loose(size, strength)
    found = certify(start)
    assert found.verdict is Verdict.NOT_CONVERGED
    assert found.residual == pytest.approx(certify(loose(1.0, 1.0)).residual, rel=1e-6)
    result = solve(start)
    assert result.converged
    assert result.certificate.verdict is Verdict.STABLE
    top = result.surface.vertices[start.n // 2 :, 2].max() / size
    assert top == pytest.approx(0.5262, abs=1e-4)


def test_a_loose_part_of_a_patch_far_from_rest_is_not_certified():
    """It is 1e-8 of its patch: beside the forces of the rest, its own are not seen."""
    found = certify(loose(1e-8, 1.0, one_patch=True))
    assert found.verdict is Verdict.NOT_CONVERGED
    assert found.residual > 0.1


def test_an_island_of_a_patch_is_judged_by_itself():
    """Two roofs of one patch at rest, and one that is not, joined to them by a patch that pulls far more."""
    stiff = beside_a_stiff_roof(1e10)
    X = np.concatenate([stiff.vertices, [[-5, 1, 0], [-5, -1, 0], [-4, 0, 8**-0.5]]])
    F = [*stiff.faces.tolist(), [5, 8, 10], [8, 9, 10], [9, 7, 10], [7, 5, 10]]
    fixed = np.concatenate([stiff.fixed, [True, True, False]])
    patches = (Patch("roof", 1.0), stiff.patches[1])
    found = certify(Surface(X, F, [0] * 4 + [1] * 4 + [0] * 4, patches, fixed=fixed))
    assert found.verdict is Verdict.NOT_CONVERGED
    assert found.detail.startswith("the forces left in patch 'roof', or in an island of it, are 4.7e-01")


def test_what_rounding_hides_is_undecided():
    """Coordinates near 3 leave a part of size 1e-11 four digits."""
    result = solve(loose(1e-11, 1.0))
    assert result.converged
    assert result.certificate.verdict is Verdict.UNDECIDED
    assert "rounding of the coordinates alone leaves" in result.certificate.detail
