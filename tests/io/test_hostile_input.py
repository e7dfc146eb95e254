"""Input that no one means: each is refused by name and place, or taken for exactly what it is."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
from refusals import refused
from shapes import pyramid

import pcmc
from pcmc import Patch, Plane, Surface, Verdict, certify, project, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.certificate import Evidence
from pcmc.meshing.refinement import refine
from pcmc.solvers.result import Status

X, F = pyramid().vertices, pyramid().faces
HUGE = 10**400


ROOF = (Patch("roof", 1.0),)


def surface(vertices=X, faces=F, patches=ROOF, fixed=range(4), **others) -> Surface:
    return Surface(vertices, faces, [0] * 4, patches, fixed, **others)


@pytest.mark.parametrize("move", [Surface.moved, lambda s, x: surface(x)], ids=["moved", "made"])
@pytest.mark.parametrize("scale", [1e51, 1e200])
def test_nothing_lies_beyond_the_reach_of_floats(move, scale):
    with refused(SurfaceError, what="vertices", where=0):
        move(pyramid(), scale * X)


def test_nothing_is_so_small_that_its_areas_vanish():
    with refused(SurfaceError, what="vertices", expected="≥ 1e-50"):
        surface(1e-60 * X)
    with refused(SurfaceError, what="tension", where="roof", found=1e-60, expected="0 or ≥ 1e-50"):
        Patch("roof", 1e-60, 0.0)
    for key, value, bound in (("pressure", -1e-60, "≤ -"), ("weight", 1e-60, "≥ "), ("snow", 1e-300, "≥ ")):
        with refused(SurfaceError, what=key, where="roof", found=value, expected=f"0 or {bound}1e-50"):
            Patch("roof", 1.0, **{key: value})


@pytest.mark.parametrize("door", [pcmc.read, lambda p: pcmc.write(p, pyramid()), project.load])
def test_what_is_no_path_is_refused_in_one_line(door):
    with refused(OptionError, what="path", found=5):
        door(5)


@pytest.mark.parametrize("scale", [1e-49, 1e-20, 1e20, 1e49])
def test_a_surface_of_any_size_within_reach_is_solved(scale):
    """α = size · p: the same shape."""
    result = solve(surface(scale * X, patches=[Patch("roof", 1.0, 1.0 / scale)]))
    assert result.converged
    assert result.certificate.verdict is Verdict.STABLE
    assert result.surface.vertices[4, 2] == pytest.approx(scale / 8**0.5)


@pytest.mark.parametrize("method", ["nesterov", "lbfgs"])
def test_a_run_that_leaves_the_reach_ends_with_the_last_surface_within(method):
    result = solve(pyramid(1e49), method, **({"t0": 1e10} if method == "nesterov" else {}))
    assert isinstance(result.status, Status)
    assert np.abs(result.surface.vertices).max() <= 1e50
    assert isinstance(result.certificate.verdict, Verdict)


def test_a_surface_shrunk_to_a_point_is_judged():
    assert certify(pyramid().moved(0.0 * X)).verdict is Verdict.DEGENERATE


@pytest.mark.parametrize("length", [5e-324, 1e-200, 1e200, 1e308])
def test_a_normal_of_any_length_becomes_a_unit_vector(length):
    assert Plane(normal=(0, 0, length)).normal == (0.0, 0.0, 1.0)
    assert np.linalg.norm(Plane(normal=(length, length, -length)).normal) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(
    "again",
    [copy.copy, copy.deepcopy, dataclasses.replace, lambda s: pickle.loads(pickle.dumps(s))],
    ids=["copy", "deepcopy", "replace", "pickle"],
)
def test_a_copy_can_be_written_to_no_more_than_the_surface(again):
    first = surface()
    certify(first)  # what is computed once is there
    other = again(first)
    assert (other.vertices == first.vertices).all()
    assert certify(other).energy == certify(first).energy
    arrays = [other.vertices, other.faces, other.patch_of_face, other.fixed, other.on_plane]
    arrays += [other.tensions, other.pressures, other.walls, other.origin, other.uncancelled]
    arrays += [other.topology.edges, other.topology.valence, other.topology.vertex_kind, other.plane.axes]
    assert not any(array.flags.writeable for array in arrays)


def test_a_copy_far_from_the_plane_is_seen_from_the_same_point():
    far = surface(X + np.array([1e6, 0, 0]))
    moved = far.moved(X + np.array([1e6 + 1.0, 0, 0]))
    for other in (copy.deepcopy(moved), pickle.loads(pickle.dumps(moved))):
        assert (other.origin == far.origin).all()


NOT_NUMBERS = {
    "complex": X + 1j,
    "complex without imaginary part": X + 0j,
    "masked": np.ma.masked_array(X, mask=X > 0.5),
    "masked rows": [np.ma.masked_array(x, mask=x > 0.5) for x in X],
    "words": X.astype(str),
    "dates": np.zeros((5, 3), "datetime64[s]"),
    "nothing": None,
    "objects": np.array([[None] * 3] * 5),
    "400 digits": [[HUGE, 0, 0], *X[1:].tolist()],
    "a mapping": {0: 1},
}


@pytest.mark.parametrize("values", NOT_NUMBERS.values(), ids=NOT_NUMBERS)
@pytest.mark.parametrize("what", ["vertices", "faces", "fixed", "on_plane"])
def test_arrays_of_anything_but_real_numbers_are_refused(what, values):
    with refused(SurfaceError, what=what):
        surface(**{what: values})


def test_an_array_whose_mask_hides_nothing_is_taken():
    assert (surface(np.ma.masked_array(X, mask=False)).vertices == X).all()


def test_generators_are_read_once():
    read = surface((x for x in X), iter(F), (p for p in [Patch("roof", 1.0)]), (i for i in range(4)))
    assert (read.n, read.m, read.patches, read.fixed.sum()) == (5, 4, (Patch("roof", 1.0),), 4)


@pytest.mark.parametrize("patches", ["roof", Patch("roof", 1.0), {"roof": 1.0}, [], None, ["roof"]])
def test_patches_are_a_sequence_of_patch(patches):
    with refused(SurfaceError, what="patches", expected="a sequence of Patch"):
        surface(patches=patches)


SINGLE = {
    "tension": lambda: Patch("roof", HUGE),
    "pressure": lambda: Patch("roof", 1.0, HUGE),
    "Plane.point": lambda: Plane((HUGE, 0, 0)),
    "Plane.normal": lambda: Plane(normal=np.ma.masked_array([0.0, 0.0, 1.0], mask=[0, 0, 1])),
    "Patch.name": lambda: Patch(None, 1.0),
    "wall": lambda: Patch("roof", 1.0, wall="no"),
    "tensions": lambda: pyramid().retensioned([("roof", 2.0)]),
    "walls": lambda: pyramid().retensioned(walls="roof"),
    "surface": lambda: certify(None),
}


@pytest.mark.parametrize("what", SINGLE)
def test_single_values_are_refused_by_name(what):
    with refused(SurfaceError, what=what):
        SINGLE[what]()


@pytest.mark.parametrize(
    "measure",
    [pcmc.energy, pcmc.gradient, pcmc.hessian, pcmc.mean_curvature, pcmc.target_curvature, refine, solve],
)
def test_only_a_surface_is_measured(measure):
    with refused(SurfaceError, what="surface", found="NoneType", expected="a Surface"):
        measure(None)


OPTIONS = {
    "tolerance": [np.nan, "1e-8", -1.0, HUGE],
    "modes": [-1, "all", 10**19, 1.5],
    "evidence": ["inflated", Evidence],
}


@pytest.mark.parametrize(("what", "found"), [(what, found) for what in OPTIONS for found in OPTIONS[what]])
def test_options_of_certify_are_checked(what, found):
    with refused(OptionError, what=what):
        certify(pyramid(), **{what: found})


@pytest.mark.parametrize("method", [["newton"], np.array(["newton"]), None, {}, b"newton"], ids=repr)
def test_a_method_is_named_by_a_text(method):
    with refused(OptionError, what="method"):
        solve(pyramid(), method)


@pytest.mark.parametrize(
    ("what", "options"),
    [
        ("levels", {"levels": 10**19}),
        ("levels", {"levels": 15}),
        ("iterations", {"iterations": HUGE}),
        ("tolerance", {"tolerance": HUGE}),
        ("memory", {"method": "lbfgs", "memory": 10**19}),
        ("evaluations", {"method": "lbfgs", "evaluations": HUGE}),
        ("floor_power", {"method": "nesterov", "floor_power": 10**19}),
    ],
)
def test_counts_beyond_all_meaning_are_refused_and_not_begun(what, options):
    with refused(OptionError, what=what) as caught:
        solve(pyramid(), **options)
    assert len(str(caught.value)) < 300


def test_refinements_are_counted_before_they_are_made():
    with refused(OptionError, what="levels", found=15, expected="a whole number ≥ 0 and ≤ 14"):
        refine(pyramid(), 15)


SCALES = [(1e-20, 1.0), (1e-45, 1.0), (1e20, 1.0), (1.0, 1e-40), (1.0, 1e40), (1e-20, 1e20), (1e30, 1e30)]


@pytest.mark.parametrize(("size", "alpha"), SCALES)
@pytest.mark.parametrize("method", ["nesterov", "lbfgs", "newton"])
def test_no_method_takes_another_scale_for_rest(method, size, alpha):
    """The same shape at any size and tension, and not where it starts."""
    options = {"t0": 0.1 / alpha} if method == "nesterov" else {}
    result = solve(surface(size * X, patches=[Patch("roof", alpha, alpha / size)]), method, **options)
    assert result.surface.vertices[4, 2] / size == pytest.approx(1.0 / 8**0.5, rel=1e-3)
    assert result.certify(tolerance=2e-4).verdict is Verdict.STABLE
