"""Cables with a weight: the catenary, derivatives, balance, and files that carry or refuse the weight."""

import dataclasses
from itertools import pairwise
from math import cosh

import numpy as np
import pytest
from cable_cases import hanging, heavy_net
from refusals import refused
from scipy.optimize import brentq

import pcmc
from generators.grid import grid_faces
from pcmc import Cable, Patch, Surface, Verdict, solve
from pcmc.base.errors import LostWarning, OptionError, SurfaceError
from pcmc.design.targets import Target, measure
from pcmc.diagnostics import check_gradient, check_hessian
from pcmc.forces.motion_space import vertex_classes
from pcmc.structure.loads import load_steps
from pcmc.surface.topology import CURVE, POINT


@pytest.fixture(scope="module")
def rope():
    return solve(hanging(16), tolerance=1e-14).surface


def test_taylor_slopes():
    for surface in (heavy_net(), heavy_net().moved(heavy_net().vertices + np.array([0.0, 0.0, 0.7]))):
        assert check_gradient(surface).slope == pytest.approx(2.0, abs=0.05)
        assert check_hessian(surface).slope == pytest.approx(3.0, abs=0.05)


def test_a_rope_hangs_in_its_catenary():
    """z + τ/g = c cosh(x/c), with errors of second order."""
    c, errors = brentq(lambda c: c * cosh(1.0 / c) - 2.0, 1.0, 5.0), []
    for columns in (4, 8, 16):
        surface = solve(hanging(columns), tolerance=1e-14).surface
        x, _, z = surface.vertices[np.unique(surface.cables[0].edges)].T
        errors.append(np.abs(z - (c * np.cosh(x / c) - 1.0)).max())
    assert errors[-1] < 1e-3
    assert [np.log2(a / b) for a, b in pairwise(errors)] == pytest.approx([2.0, 2.0], abs=0.1)


def test_its_certificate(rope):
    certificate = pcmc.certify(rope)
    assert certificate.verdict is Verdict.STABLE
    (force,) = certificate.cables.tension
    assert force == pytest.approx(2.0)  # τ + g z at the ends
    assert certificate.cables.sheet_pull[0] == pytest.approx(certificate.cables.cable_pull[0], rel=1e-2)
    length = float(np.linalg.norm(np.diff(rope.vertices[rope.cables[0].edges], axis=1), axis=2).sum())
    loads, supports, remainder = certificate.balance.force_z
    assert loads == pytest.approx(-length)
    assert supports == pytest.approx(length, rel=1e-4)
    assert abs(remainder) < 1e-4 * length
    ends = certificate.cable_ends
    assert np.linalg.norm(ends[["force_x", "force_y", "force_z"]], axis=1) == pytest.approx(2.0)


def test_where_the_weight_leaves_no_tension():
    """An upright rope, whose weight acts along it, far below Π."""
    certificate = pcmc.certify(hanging(8).rebuilt(plane=pcmc.Plane((3.5, 0.0, 0.0), (1.0, 0.0, 0.0))))
    assert not certificate.certified
    assert "is under compression at" in str(certificate)


def test_the_theorem_says_that_it_does_not_cover_it(rope):
    theorem = pcmc.verify(rope)
    assert not theorem.proved
    assert "a cable has a weight" in theorem.reason


def test_a_weight_that_changes_along_a_cable_ends_its_curve():
    surface = hanging(4)
    row = np.flatnonzero(surface.vertices[:, 2] == 1.0)
    two = [
        Cable.along("left", 1.0, row[:3]),
        dataclasses.replace(Cable.along("right", 1.0, row[2:]), weight=0.5),
    ]
    kind = vertex_classes(dataclasses.replace(surface, cables=two)).kind
    assert kind[row[1:4]].tolist() == [CURVE, POINT, CURVE]


def test_the_structural_model_carries_it(rope):
    (form,) = load_steps(rope, ())
    length = float(np.linalg.norm(np.diff(rope.vertices[rope.cables[0].edges], axis=1), axis=2).sum())
    assert form.forces.sum(axis=0) == pytest.approx([0.0, 0.0, -length])


@pytest.mark.parametrize("suffix", [".pcmc", ".obj", ".vtp", ".glb"])
def test_files_carry_it(tmp_path, suffix):
    path = tmp_path / f"net{suffix}"
    pcmc.write(path, heavy_net())
    again = pcmc.read(path)
    assert [(c.name, c.weight) for c in again.cables] == [(c.name, c.weight) for c in heavy_net().cables]
    assert pcmc.energy(again) == pytest.approx(pcmc.energy(heavy_net()), rel=1e-6)


@pytest.mark.parametrize("suffix", [".fe", ".stl"])
def test_other_files_say_that_they_do_not(tmp_path, suffix):
    with pytest.warns(LostWarning, match="weights of cables"):
        pcmc.write(tmp_path / f"net{suffix}", heavy_net())


def test_refusals():
    with refused(SurfaceError, what="tension", found=0.0):
        Cable("a", 0.0, [[0, 1]], weight=1.0)
    with refused(SurfaceError, what="weight"):
        Cable("a", 1.0, [[0, 1]], weight=float("nan"))
    with refused(OptionError, what="of", found="edge"):
        measure(heavy_net(), Target("force", "edge", 1.0))
    assert "weight 0.5" in repr(heavy_net())


def test_a_cut_and_its_mirror_image_keep_it():
    whole = hanging(4)
    half = pcmc.cut(whole, pcmc.Plane((0, 0, 0), (1, 0, 0)))
    assert half.cables[0].weight == 1.0
    assert pcmc.mirrored(half).cables[0].weight == 1.0


def heavy_rope():
    """A flat sheet with a rope of 0.02 that weighs 0.01 along its middle, held 1 below Π."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 9), np.linspace(-1.0, 1.0, 9), indexing="ij")
    X = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=1)
    rope = dataclasses.replace(Cable.along("rope", 0.02, np.flatnonzero(X[:, 0] == 0.0)), weight=0.01)
    faces, rim = grid_faces(8, 8), (np.abs(X[:, :2]) == 1.0).any(axis=1)
    plane = pcmc.Plane((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    patches = [Patch("sheet", 1.0, 0.0)]
    surface = Surface(X, faces, np.zeros(len(faces), int), patches, fixed=rim, cables=[rope], plane=plane)
    return solve(surface).surface


@pytest.mark.nightly
def test_a_margin_ends_where_a_cable_is_compressed():
    found = pcmc.margin(heavy_rope(), "cable")
    assert found.ends_by is pcmc.accuracy.MarginEnd.COMPRESSION
    assert found.factor == pytest.approx(0.5, abs=0.003)  # τ λ + g z = 0 at z = -1, and the sag 0.0033
