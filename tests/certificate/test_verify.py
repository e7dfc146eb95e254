"""Theorems: true in many digits, and refused where they cannot be had."""

import cable_cases
import numpy as np
import pytest
import shapes
import volume_cases
from exact_energy import Frozen, negative
from flint import arb
from held_walls import example
from motion_cases import SURFACES

import generators
import pcmc
from pcmc import Patch, Surface, solve, verify
from pcmc.certificate import balls, enclosures, theorem
from pcmc.certificate.lipschitz import lipschitz
from pcmc.certificate.system import system
from pcmc.forces.motion_space import motion_space
from pcmc.forces.pattern import hessian_pattern
from pcmc.forces.pinching import pull_and_capacity, standing_part
from pcmc.forces.second_variation import assemble
from pcmc.stability.equilibrium import Equilibrium
from studies.forces.cases import hanging_barrel
from tests.surface import test_lines

CASES = {
    "cap": lambda: solve(shapes.cap(2)),
    "wall, bottom sliding": lambda: solve(generators.two_squares(3)),
    "catenoid, a saddle": lambda: solve(
        generators.catenoid(0.8, half_distance=0.6, deep=True), target="stationary"
    ),
    "cables": lambda: solve(generators.hypar_roof(3, height=0.5)),
    "weight, mirror planes": lambda: solve(hanging_barrel(3)),
    "pressure, flat pieces": lambda: solve(generators.barrel(4)),
    "snow": lambda: solve(shapes.cap(2).with_snow(0.3)),
    "room": lambda: solve(volume_cases.cap(1.0, 0.5)),
    "rings and a volume": lambda: solve(volume_cases.cylinder(0.8, 2.0, "rings")),
    "a junction at rest": lambda: solve(generators.two_squares(4, alpha_aux=3.0)),
    "at rest on a held bottom": lambda: solve(example(4, 2.5)),
    "hemisphere, free to slide": lambda: solve(generators.hemisphere(1.2), target="stationary"),
    "two bubbles, free to move": lambda: solve(generators.double_bubble(0.7, volumes=(1.0, 1.0))),
    "ends along lines": lambda: solve(test_lines.film(2, 3, 2)),
}


@pytest.mark.parametrize("case", CASES)
def test_the_theorem_is_true_in_fifty_digits(case):
    """The equilibrium in the same frames, by Newton in many digits, is where it says, with index and gap."""
    surface = CASES[case]().surface
    proved = verify(surface)
    assert proved.proved, proved.reason
    frozen = Frozen(surface)
    s, matrix = frozen.equilibrium()
    distance = sum((x * x for x in s[: frozen.size]), arb(0)).sqrt()
    assert distance < arb(proved.radius)
    assert 0.0 < proved.radius < 1e-7 * surface.size
    assert proved.index == pcmc.certify(surface).index
    for shift in (-proved.gap, 0.0, proved.gap):
        assert negative(matrix, shift, frozen.borders) == proved.index


def parts(surface: Surface):
    part = standing_part(surface)
    space = motion_space(part.surface, part.classes, part.surface.vertices)
    pattern = hessian_pattern(part.classes, space)
    return part, space, pattern, enclosures.mesh_arrays(part.surface, part.classes, pattern)


@pytest.mark.parametrize(
    "surface",
    [
        shapes.three_patches(2),
        cable_cases.net(),
        generators.barrel(3).retensioned(weights={"vault": 0.3}),
    ],
    ids=["walls", "cables and weights", "flat pieces"],
)
def test_balls_hold_the_exact_derivatives(surface):
    part, space, pattern, items = parts(surface)
    frozen = Frozen(surface)
    gradient, hessian = frozen.derivatives([arb(0)] * (frozen.size + frozen.borders))
    ends = enclosures.flat_pieces(part.surface).end_patch
    found = enclosures.forces(items, part.surface.net_pressures[ends])
    for k, (value, radius) in enumerate(zip(*enclosures.coordinates(space, *found), strict=True)):
        assert abs(gradient[k] - arb(value)) <= arb(radius * balls.SAFE) + arb(10) ** -60
        assert radius < 1e-12
    values, radii = enclosures.second_variation(items, space, pattern)
    for i in range(space.size):
        for at in range(pattern.indptr[i], pattern.indptr[i + 1]):
            off = abs(hessian[i][pattern.indices[at]] - arb(values[at]))
            assert off <= arb(radii[at] * balls.SAFE) + arb(10) ** -30
            assert radii[at] < 1e-11


def test_balls_of_volumes_hold_them():
    """The lid is flat and misses the origin: its flat pieces count, too."""
    surface = volume_cases.cylinder(0.8, 2.0, "plates")
    _, _, _, items = parts(surface)
    ends = enclosures.flat_pieces(surface).end_patch
    value, radius = enclosures.signed_volumes(items, np.array(surface.room_signs), ends)
    assert abs(value[0] - pcmc.room_volumes(surface)[0]) <= 2.0 * radius[0] < 1e-11


@pytest.mark.parametrize("surface", [shapes.generic(), shapes.cap(5), cable_cases.net()])
def test_no_matrix_changes_faster_than_the_constant(surface):
    part, space, pattern, items = parts(surface)
    bound, _, height = lipschitz(items, space, 0.0, 0.0)
    rng, X, seen = np.random.default_rng(0), part.surface.vertices, 0.0
    for k in range(30):
        d = rng.normal(size=space.size) * (rng.random(space.size) < (1.0 if k % 2 else 3 / space.size))
        d *= 1e-5 * height / max(np.linalg.norm(d), 1e-9)
        ahead, behind = (
            pattern.symmetric(assemble(part.surface, part.classes, space, pattern, Y)).toarray()
            for Y in (X + space.to_vectors(d), X - space.to_vectors(d))
        )
        if d.any():
            seen = max(seen, np.linalg.norm(ahead - behind, 2) / (2.0 * np.linalg.norm(d)))
    assert seen <= bound <= 100.0 * seen
    assert bound <= lipschitz(items, space, 0.01 * height, 0.0)[0]


def test_radius_and_gap_are_nearly_sharp(monkeypatch):
    """With one unknown all bounds but the estimate of σ are equalities: half of them would be false."""
    monkeypatch.setattr(theorem, "SHARE", 0.99)
    height = 0.125**0.5
    roof = shapes.pyramid(height=height + 2e-9)
    proved = verify(roof)
    s, matrix = Frozen(roof).equilibrium()
    assert abs(float(s[0])) == pytest.approx(2e-9, rel=1e-6)
    assert 1.0 <= proved.radius / abs(float(s[0])) < 1.03
    assert 0.97 < proved.gap / float(matrix[0][0]) <= 1.0
    space = motion_space(roof, standing_part(roof).classes, roof.vertices)
    found = system(standing_part(roof), space, np.zeros((space.size, 0)))
    assert found.residual == pytest.approx(float(matrix[0][0]) * 2e-9, rel=1e-5)


def test_a_spoiled_surface_is_refused_with_the_reason():
    surface = solve(generators.two_squares(4)).surface
    moves = np.random.default_rng(0).normal(size=surface.vertices.shape)
    moves[surface.held] = 0.0
    spoiled = verify(surface.moved(surface.vertices + 1e-6 * surface.size * moves))
    assert not spoiled.proved
    assert spoiled.index is None
    assert "not at rest" in str(spoiled)
    assert "not at rest" in verify(generators.two_squares(4)).reason


def test_a_wrong_energy_is_refused():
    """Another tension of 1 part in 1e6 leaves forces that the certificate's tolerance does not allow."""
    surface = solve(shapes.cap(4)).surface
    assert verify(surface).proved
    assert not verify(surface.retensioned({"cap": 0.6 * (1.0 + 1e-6)})).proved


def test_what_it_does_not_cover_is_refused_in_one_line():
    heavy = solve(generators.sphere(0.9), target="stationary").surface
    assert verify(heavy).proved
    assert "pushes along" in verify(heavy.retensioned(weights={heavy.patches[0].name: 1e-14})).reason
    flat = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("a", 1.0)], fixed=range(3))
    assert verify(flat).reason == "no vertex can move"


def test_a_junction_about_to_lift_is_refused():
    """A capacity only just above the pull: which vertices rest is not certain."""
    surface = solve(generators.two_squares(4, alpha_aux=3.0)).surface
    assert verify(surface).proved
    part = standing_part(surface)
    pull, capacity = pull_and_capacity(part)
    share = float((np.abs(pull) / np.maximum(capacity, 1e-300)).max())
    on_the_verge = surface.retensioned({"wall": 3.0 * share * (1.0 + 1e-12)})
    assert "verge" in verify(on_the_verge).reason


def test_free_rigid_motions_are_named_with_index_and_gap():
    """In the frozen frames they are not whole, and have small eigenvalues that no gap may deny."""
    surface = pcmc.solve(SURFACES["bubbles"](), target="stationary").surface
    found = verify(surface)
    everything = Equilibrium.of(surface).factorised().matrix.toarray()
    assert np.abs(np.linalg.eigvalsh(everything)).min() < found.gap
    assert f"index is exactly {found.index}, among motions that are across its 5 free rigid" in str(found)
    assert "second variation among these is within" in str(found)
