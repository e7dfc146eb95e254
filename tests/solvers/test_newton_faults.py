"""The geometric solver when it is given what it cannot solve."""

import numpy as np
import pytest
from backends import every_backend
from nightly import at_night
from refusals import refused
from shapes import pyramid
from starts import four_fans, sphere, spherical_cap, two_squares

from pcmc import Patch, Surface, energy, solve
from pcmc.base.errors import SurfaceError
from pcmc.certificate import Verdict
from pcmc.meshing.quality import triangle_quality
from pcmc.solvers import solve_once
from pcmc.solvers.result import Status

pytestmark = [
    pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning"),
    every_backend,
]
TARGETS = pytest.mark.parametrize("target", ["minimum", "stationary"])


def test_a_run_that_slips_ends_at_the_saddle_it_came_from(backend):
    result = solve(four_fans(7), backend=backend)
    assert result.status is Status.SADDLE
    assert "index 2: 2 ways down; the mode moves the junction" in result.message
    assert "slip: one edge away the junction moves" in result.message
    assert result.certificate.verdict is Verdict.SADDLE
    assert result.certificate.index == 2


def test_a_lost_run_tells_of_the_saddle_that_is_near(backend):
    """From 8 R above a disc the run collapses; the upper cap is a saddle in which no junction slips."""
    cap = spherical_cap(0.25, alpha=0.8)
    X = cap.vertices * [1.0, 1.0, 0.0]
    X[:, 2] = 8.0 * (1.0 - (X**2).sum(axis=1)) * cap.free
    result = solve_once(cap.moved(X), backend=backend)
    assert result.status is Status.DEGENERATE
    assert "a saddle of index 1 is near: target='stationary' returns it" in result.message


def test_a_collapsed_surface_is_no_start(backend):
    surface = two_squares(4)
    with refused(SurfaceError, what="vertices"):
        solve(surface.moved(0.0 * surface.vertices), backend=backend)


def cap_with(move):
    """A cap on which one free vertex next to the middle is moved first."""
    surface = spherical_cap(0.25)
    X = surface.vertices.copy()
    move(surface, X)
    return surface.moved(X)


def thrown(fraction):
    """Vertex 3 towards, and beyond, the farthest of its neighbours."""

    def move(surface, X):
        near = np.unique(surface.faces[(surface.faces == 3).any(axis=1)])
        far = near[np.linalg.norm(X[near] - X[3], axis=1).argmax()]
        X[3] += fraction * (X[far] - X[3])

    return move


def flattened(surface, X):
    a, b, c = surface.faces[40]
    X[c] = 0.5 * (X[a] + X[b])


def merged(surface, X):
    a, b, _ = surface.faces[20]
    X[a] = X[b]


@TARGETS
@pytest.mark.parametrize(
    "move",
    [thrown(1.5), thrown(4.0), flattened, merged],
    ids=["inverted", "inverted far", "zero area", "merged"],
)
def test_bad_triangles_at_the_start_are_mended(backend, target, move):
    start = cap_with(move)
    normal = np.cross(
        *np.moveaxis(start.vertices[start.faces[:, 1:]] - start.vertices[start.faces[:, :1]], 1, 0)
    )
    assert normal[:, 2].min() <= 1e-9
    result = solve(start, target=target, backend=backend)
    assert result.converged
    assert result.certificate.verdict is Verdict.STABLE
    corners = result.surface.vertices[start.faces]
    assert np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2].min() > 0.0
    assert result.certificate.quality > 0.4
    assert result.energy == pytest.approx(solve(spherical_cap(0.25)).energy, rel=2e-2)


@TARGETS
def test_a_mesh_that_cannot_be_mended_is_named(backend, target):
    """A needle a million times as high as wide."""
    result = solve_once(pyramid(height=1e6), target=target, backend=backend)
    assert result.status is Status.DEGENERATE
    assert result.certificate.verdict is Verdict.DEGENERATE
    assert "of patch 'roof' near (" in result.certificate.detail
    assert "slips" not in result.certificate.detail
    assert np.isfinite(result.surface.vertices).all()
    assert solve(pyramid(height=1e6), target=target, backend=backend).certificate.verdict is Verdict.STABLE


def test_zero_area_is_refused_with_the_face(backend):
    X = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]]
    with pytest.raises(SurfaceError, match=r"faces\[0\] = \[0, 1, 2\] of patch 'roof' has zero"):
        solve(Surface(X, [[0, 1, 2], [0, 2, 3]], [0, 0], [Patch("roof", 1.0)], fixed=[0]), backend=backend)


def together(one, two, held=True):
    """Two surfaces as one; the second without its supports unless ``held``."""
    patches = [*one.patches, *(Patch(p.name + " too", p.tension, p.pressure) for p in two.patches)]
    return Surface(
        np.concatenate([one.vertices, two.vertices]),
        np.concatenate([one.faces, two.faces + one.n]),
        np.concatenate([one.patch_of_face, two.patch_of_face + len(one.patches)]),
        patches,
        fixed=np.concatenate([one.fixed, two.fixed & held]),
        on_plane=np.concatenate([one.on_plane, two.on_plane & held]),
    )


def beside(surface):
    return surface.moved(surface.vertices + np.array([10.0, 0.0, 5.0]))


@TARGETS
def test_a_part_that_nothing_holds_is_named(backend, target):
    loose = together(spherical_cap(0.25), beside(spherical_cap(0.25)), held=False)
    with refused(SurfaceError, what="cap too", where=61):
        solve(loose, target=target, backend=backend)


def test_two_parts_that_are_held(backend):
    both = solve(together(two_squares(4, alpha_aux=1.0), beside(spherical_cap(0.25))), backend=backend)
    assert both.certificate.verdict is Verdict.STABLE
    alone = [
        solve(two_squares(4, alpha_aux=1.0), backend=backend),
        solve(spherical_cap(0.25), backend=backend),
    ]
    area = [result.certificate.patches["area"] for result in (both, *alone)]
    np.testing.assert_allclose(area[0], np.concatenate(area[1:]), rtol=1e-5)


def test_a_bubble_beside_a_roof(backend):
    """The bubble floats: its translations cost nothing, and are no way down."""
    surface = together(spherical_cap(0.25), beside(sphere(0.8)))
    result = solve(surface, target="stationary", backend=backend)
    assert result.converged
    assert result.certificate.verdict is Verdict.SADDLE
    assert result.certificate.index == 1


@TARGETS
@pytest.mark.parametrize(("right", "wall"), [(1.0, 0.0), (2.0, 1.0)])
def test_tensions_that_cannot_balance_are_named(backend, target, right, wall):
    surface = two_squares(4, alpha_aux=wall).retensioned({"left": 4.0, "right": right})
    result = solve(surface, target=target, backend=backend)
    assert np.isfinite(result.surface.vertices).all()
    found = result.certificate
    assert found.verdict is Verdict.NO_EQUILIBRIUM
    names = "the tensions at the junction left | right | wall cannot balance: 4 > "
    assert names in found.detail


@TARGETS
@pytest.mark.parametrize("right", [3.0, *at_night(3.02)])
def test_tensions_at_the_limit_of_balance_are_named(backend, target, right):
    """Where 4 = 3 + 1, the weaker patch and the wall would have to lie on each other."""
    surface = two_squares(4, alpha_aux=1.0).retensioned({"left": 4.0, "right": right})
    found = solve(surface, target=target, backend=backend).certificate
    assert found.verdict is Verdict.DEGENERATE
    assert "junction left | right | wall could balance only with its sheets nearly" in found.detail
    assert f"4 against 1 + {right:g}" in found.detail


@TARGETS
def test_a_wall_that_outweighs_its_sheets_comes_down(backend, target):
    """No angle balances 9 against 4 and 4, but Π takes the rest."""
    surface = two_squares(4, alpha_aux=9.0).retensioned({"left": 4.0, "right": 4.0})
    found = solve(surface, target=target, backend=backend).certificate
    assert found.verdict is Verdict.STABLE
    assert len(found.pinched) == 3


def test_motions_that_cost_nothing_are_no_obstacle(backend):
    """Strong walls pull a whole crossing down to Π, where the middle vertex may lie anywhere."""
    result = solve(four_fans(5, alpha_aux=16.0), target="stationary", backend=backend)
    assert result.converged
    assert result.certificate.residual <= 1e-10
    assert result.certificate.verdict is Verdict.SADDLE
    assert len(result.certificate.pinched) == 17


def test_walls_without_tension_meet_in_a_line(backend):
    """A junction of sheets none of which pulls has no say: the roof over it is the cap."""
    result = solve(four_fans(5, alpha_aux=0.0), backend=backend)
    assert result.certificate.verdict is Verdict.STABLE
    assert np.isfinite(result.surface.vertices).all()
    cap = solve(spherical_cap(4.0, radius=20.0, alpha=10.0), target="stationary", backend=backend)
    assert result.surface.vertices[:, 2].max() == pytest.approx(cap.surface.vertices[:, 2].max(), rel=0.1)


@pytest.mark.parametrize(
    "surface",
    [pyramid(fixed=range(5)), pyramid(), pyramid(height=0.0), pyramid(height=-3.0)],
    ids=["nothing moves", "one vertex", "flat", "hanging"],
)
def test_the_smallest_surfaces(backend, surface):
    result = solve(surface, backend=backend)
    assert result.converged
    assert result.certificate.verdict is Verdict.STABLE
    if surface.free.any():
        assert result.surface.vertices[4, 2] == pytest.approx(8**-0.5, abs=1e-9)
    else:
        assert result.iterations == 0


@pytest.mark.parametrize(
    ("target", "seed", "verdict"),
    [
        ("minimum", 0, Verdict.STABLE),
        ("minimum", 1, Verdict.STABLE),
        ("minimum", 2, Verdict.STABLE),
        ("stationary", 0, Verdict.STABLE),
        ("stationary", 1, Verdict.STABLE),
        ("stationary", 2, Verdict.SADDLE),  # the upper cap
    ],
)
def test_a_start_of_pure_noise_ends_at_a_cap(backend, target, seed, verdict):
    surface = spherical_cap(0.25)
    X = surface.vertices + np.where(surface.free[:, None], 1.0, 0.0) * np.random.default_rng(
        seed
    ).standard_normal((surface.n, 3))
    result = solve(surface.moved(X), target=target, iterations=60, backend=backend)
    assert np.isfinite(result.surface.vertices).all()
    assert np.isfinite(result.energy)
    assert result.energy == pytest.approx(energy(result.surface), rel=1e-12)
    assert (result.surface.vertices[surface.fixed] == surface.vertices[surface.fixed]).all()
    assert result.converged
    assert result.certificate.verdict is verdict
    noisy, mended = (triangle_quality(Y, surface.faces).min() for Y in (X, result.surface.vertices))
    assert noisy < 0.1 < 0.3 < mended
