"""Proofs that no smooth surface is at rest, on data that no shape changes, and what a search tells."""

import numpy as np
import pytest
from nightly import at_night
from scipy.integrate import solve_ivp
from shapes import pyramid, tube
from starts import spherical_cap, two_squares

from generators.grid import grid_faces
from pcmc import Cable, Patch, Plane, Surface, Verdict, certify, cut, margin, solve
from pcmc.base.errors import NoBranch, SurfaceError
from pcmc.certificate.balance import load_is_given, load_ratio, overload
from pcmc.certificate.cables import weak_cable
from pcmc.plan import Plan
from pcmc.solvers import homotopy, solve_once
from pcmc.solvers.continuation import Direction, Ending, follow
from pcmc.solvers.result import Status

HEAVIEST = 1.0 / 1.5088795615383199  # w a/α of a strip of half-width a: α/w = c cosh(a/c) needs 1.5089 a


# ---- vertical balance


def test_the_load_is_given_where_what_carries_it_does_not_move():
    """p |Ω| = 60 over α length(∂Ω) = 32, whatever the shape; corners of the mesh may only lower the ratio."""
    whole = Plan([[0, 0], [10, 0], [10, 6], [0, 6]], tension=1.0, edge_length=1.0).surface()
    assert load_is_given(whole)
    assert load_ratio(whole) == pytest.approx(60.0 / 32.0)
    assert 1.3 < overload(whole).ratio <= 60.0 / 32.0
    raised = whole.moved(whole.vertices + whole.free[:, None] * [0.0, 0.0, 50.0])
    assert overload(raised) == overload(whole)


def test_of_roofs_side_by_side_each_carries_its_own_load():
    """60 over 32 beside 60 over 320: together they would carry both, but nothing joins them."""
    weak = Plan([[0, 0], [10, 0], [10, 6], [0, 6]], tension=1.0, edge_length=1.0).surface()
    X, F, n = weak.vertices, weak.faces, weak.n
    both = Surface(
        np.concatenate([X, X + np.array([20.0, 0.0, 0.0])]),
        np.concatenate([F, F + n]),
        np.repeat([0, 1], len(F)),
        [Patch("weak", 1.0), Patch("strong", 10.0)],
        fixed=np.tile(weak.fixed, 2),
    )
    assert load_ratio(both) == pytest.approx(load_ratio(weak))
    assert overload(both).ratio == pytest.approx(overload(weak).ratio)


def test_curved_elements_carry_the_load_of_their_plan():
    weak = Plan([[0, 0], [10, 0], [10, 6], [0, 6]], tension=3.0, edge_length=2.0).surface()
    curved = solve(weak, order=2).surface
    assert curved.order == 2
    assert load_ratio(curved) == pytest.approx(load_ratio(weak))


def test_between_mirrors_the_load_is_given_too():
    half = Plan([[0, 0], [5, 0], [5, 6], [0, 6]], tension=1.0, mirrors=[[[5, 0], [5, 6]]], edge_length=1.0)
    surface = half.surface()
    assert load_is_given(surface)
    assert load_ratio(surface) == pytest.approx(30.0 / 16.0)
    ((_, mask),) = surface.on_planes
    slid = surface.vertices + (mask & ~surface.fixed)[:, None] * np.array([0.0, 0.3, 9.0])
    assert overload(surface.moved(slid)).ratio == pytest.approx(overload(surface).ratio, rel=1e-12)


@pytest.mark.parametrize(
    "surface",
    [
        two_squares(4, alpha_aux=0.1).retensioned({"left": 0.1, "right": 0.1}),  # the wall's foot slides
        pyramid(0.1).rebuilt(fixed=range(3)),  # two sides are free
        pyramid(0.1).retensioned(weights={"roof": 0.01}),
        pyramid(0.1).rebuilt(fixed=(), on_plane=range(4)),
    ],
    ids=["a sliding foot", "free edges", "a weight", "on the plane"],
)
@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
def test_where_a_shape_changes_load_or_capacity_they_prove_nothing(surface):
    assert load_ratio(surface) > 1.0
    assert not load_is_given(surface)
    assert overload(surface) is None


def test_a_sliding_wall_without_tension_carries_nothing():
    """Two squares of area 32 and outline 24 need α ≥ 4/3 then; with a tension the wall may help."""
    slack = two_squares(4, alpha_aux=0.0).retensioned({"left": 1.2, "right": 1.2})
    assert overload(slack).ratio == pytest.approx(32.0 / (24.0 * 1.2))
    assert solve(two_squares(4, alpha_aux=1.0).retensioned({"left": 1.2, "right": 1.2})).converged


def test_unequal_pressures_prove_nothing_where_the_junction_moves_the_load():
    """With a wall on a held foot that takes the difference the load is given, without that it is not."""
    both = two_squares(4, alpha_aux=0.1).retensioned({"left": 0.1, "right": 0.1}, {"left": 2.0, "right": 1.0})
    held = both.rebuilt(fixed=both.fixed | both.on_plane, on_plane=())
    assert load_is_given(held) == (not held.uncancelled.any())
    assert not load_is_given(held.retensioned(None, {"wall": 0.0}))


def test_a_held_line_carries_to_its_ends_on_the_boundary():
    """The edges from its last inner vertices to the boundary were left out."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(11.0), np.arange(7.0)))
    corners = np.array([[j * 11 + k for k in range(10)] for j in range(6)]).ravel()
    middle = len(x) + np.arange(60)
    ring = [corners, corners + 1, corners + 12, corners + 11]
    F = np.concatenate([np.stack([ring[i - 1], ring[i], middle], 1) for i in range(4)])
    X = np.zeros((len(x) + 60, 3))
    X[:, 0], X[:, 1] = np.append(x, x[corners] + 0.5), np.append(y, y[corners] + 0.5)
    edge = (X[:, 0] % 10 == 0) | (X[:, 1] % 6 == 0)
    sheet = Surface(X, F, np.zeros(len(F), int), [Patch("roof", 1.0)], fixed=edge | (X[:, 0] == 5.0))
    assert load_ratio(sheet) == pytest.approx(60.0 / (32.0 + 2.0 * 6.0))


def test_a_mesh_at_rest_is_not_contradicted_but_told_of():
    """At α < 1/2 no smooth cap or roof over the square is at rest, but these meshes are."""
    for surface in (spherical_cap(0.2, alpha=0.495), pyramid(0.4)):
        result = solve(surface)
        assert overload(result.surface) is not None
        assert result.certificate.verdict is Verdict.STABLE
        assert result.proofs == result.certificate.proofs == ()
        assert "only a mesh as coarse as this is at rest here" in result.certificate.detail


# ---- flat sails


def sail(tension, corners=4, around=8, alpha=1.0, length=2.0):
    """A regular polygon of cables around a flat sheet, each a chord of this length."""
    radius = 0.5 * length / np.sin(np.pi / corners)
    angle = 2.0 * np.pi * np.arange(corners) / corners
    ends = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    share = np.arange(around)[:, None] / around
    rim = np.concatenate([a + share * (b - a) for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)])
    n, rings = len(rim), 5
    bent = rim * (1.0 - 0.05 * np.sin(np.pi * np.tile(share[:, 0], corners)))[:, None]
    X = np.concatenate([bent * (1.0 - r / rings) for r in range(rings)] + [np.zeros((1, 3))])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    F = [np.stack([i + r * n, j + r * n, j + r * n + n], 1) for r in range(rings - 1)]
    F += [np.stack([i + r * n, j + r * n + n, i + r * n + n], 1) for r in range(rings - 1)]
    last = (rings - 1) * n
    F += [np.stack([i + last, j + last, np.full(n, rings * n)], 1)]
    cables = [Cable("rim", tension, np.stack([i, j], 1))]
    fixed = np.arange(corners) * around
    F = np.concatenate(F)
    return Surface(X, F, np.zeros(len(F), int), [Patch("sail", alpha, 0.0)], fixed=fixed, cables=cables)


@pytest.mark.parametrize("corners", [3, 4, 6])
def test_cables_of_a_flat_sail_need_a_tension(corners):
    """α L / (2 sin(φ/2)), φ the angle at the masts: at it the arcs of two sides touch each other."""
    phi = np.pi * (1.0 - 2.0 / corners)
    least = 2.0 / (2.0 * np.sin(0.5 * phi))
    weak = weak_cable(sail(0.98 * least, corners))
    assert weak.least == pytest.approx(least, rel=1e-9)
    assert weak.angle == pytest.approx(phi, rel=1e-9)
    assert weak_cable(sail(1.02 * least, corners)) is None
    assert solve(sail(1.3 * least, corners)).certificate.verdict is Verdict.STABLE
    result = solve(sail(0.7 * least, corners))
    assert result.status is Status.NO_EQUILIBRIUM
    assert f"{0.7 * least:.4g} < α L / (2 sin(φ/2)) = {least:.4g}" in result.message
    assert result.certificate.verdict is Verdict.NO_EQUILIBRIUM


def test_a_held_edge_of_a_sail_turns_by_nothing():
    """A square whose first side is one held edge: at the corner between two others θ + θ' ≤ 2 · 90° holds."""
    corners, middles = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], [[1.9, 1, 0], [1, 1.9, 0], [0.1, 1, 0]]
    ring = [[0, 1], [1, 4], [4, 2], [2, 5], [5, 3], [3, 6], [6, 0]]
    faces, patch = [[*edge, 7] for edge in ring], Patch("sail", 1.0, 0.0)
    cables = [Cable("rope", 1.2, ring[1:])]
    found = Surface([*corners, *middles, [1, 1, 0]], faces, [0] * 7, [patch], fixed=range(4), cables=cables)
    assert weak_cable(found).least == pytest.approx(2.0**0.5)


def test_of_a_sail_that_is_not_flat_a_weak_cable_proves_nothing():
    weak = sail(0.5)
    assert weak_cable(weak) is not None
    lifted = weak.vertices.copy()
    lifted[0, 2] = 0.5
    for other in (
        weak.moved(lifted),
        weak.retensioned(None, {"sail": 0.1}),
        weak.retensioned(weights={"sail": 0.1}),
    ):
        assert weak_cable(other) is None


def square_sail(tension):
    """On 8 x 8 cells, of side 2: this mesh stands where a smooth sail needs cables of √2."""
    i, j = np.divmod(np.arange(81), 9)
    X, faces = np.stack([i, j, 0 * i], axis=1) / 4.0, grid_faces(8, 8)
    bare = Surface(X, faces, [0] * 128, [Patch("sail", 1.0, 0.0)], fixed=[0, 8, 72, 80])
    edges = bare.topology.edges[bare.topology.boundary_edge]
    return bare.rebuilt(cables=[Cable("rope", tension, edges)])


def test_a_coarse_sail_at_rest_is_told_that_its_cable_is_too_weak():
    certificate = solve(square_sail(1.38)).certificate
    assert certificate.verdict is Verdict.STABLE
    assert "no smooth surface is: cable 'rope' is too weak" in certificate.detail
    assert solve(square_sail(1.45)).certificate.detail == ""


def test_half_a_sail_is_as_weak_as_the_whole():
    whole = square_sail(1.2)
    half = cut(whole, Plane((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)))
    assert weak_cable(half).least == pytest.approx(weak_cable(whole).least)
    assert solve(half).status is solve(whole).status is Status.NO_EQUILIBRIUM


def test_the_margin_of_a_sail_claims_no_more_than_its_mesh():
    found = margin(solve(square_sail(1.6)), "cable")
    assert found.factor < np.sqrt(2.0) / 1.6  # where a smooth sail ends
    assert found.text().startswith("holds on this mesh at least down to")
    assert "no smooth surface is" in found.detail
    assert "on 512 triangles 0.8" in found.detail


# ---- branches


def rings(length, alpha, pressure, profile=lambda t: 1.0 + 0.0 * t, rows=40, around=16):
    shape = lambda t: (profile(t), length * (t - 0.5))  # noqa: E731
    return tube(rows, around, shape, Patch("film", alpha, pressure))


def unduloid(neck, pressure, periods):
    """Length between radii 1, and the radius over the share of it, of the unduloid with this neck; α = 1."""
    bulge = 2.0 / pressure - neck
    slope = np.sqrt((1.0 / (0.5 * pressure * (neck * bulge + 1.0))) ** 2 - 1.0)

    def turn(_, y):
        return [y[1], (1.0 + y[1] ** 2) / y[0] - pressure * (1.0 + y[1] ** 2) ** 1.5]

    def back(_, y):
        return y[0] - 1.0

    back.direction = 1.0
    run = solve_ivp(turn, [0.0, 40.0], [1.0, slope], events=back, rtol=1e-10, atol=1e-12, dense_output=True)
    crossings = run.t_events[0][run.t_events[0] > 1e-6]
    length = float(crossings[periods - 1])
    return length, lambda t: run.sol(t * length)[0]


def test_an_unduloid_that_no_branch_reaches_is_not_denied():
    """Rings at distance 13.59, α = 1, p = 0.9: a cylinder leads to none, but there is one, of index 4."""
    length, profile = unduloid(0.75, 0.9, 2)
    assert length == pytest.approx(13.59, abs=0.01)
    result = solve(rings(length, 1.0, 0.9))
    assert result.status is Status.NONE_FOUND
    assert result.proofs == ()
    fold = next(attempt for attempt in result.tried if attempt.folds)
    assert (fold.way, result.tried[0].way) == ("distance", "given start")
    assert 0.03 < fold.value < 0.5
    assert str(fold) in result.message
    found = result.certificate
    assert found.verdict is Verdict.NONE_FOUND
    assert str(fold) in found.detail
    assert "no equilibrium:" not in str(found)
    near = solve(rings(length, 1.0, 0.9, profile), target="stationary")
    assert near.converged
    assert near.certificate.index == 4


def strip(weight, height=0.0, across=16, along=6):
    """A heavy strip of half-width 1 and α = 1 between mirrors, sagging by ``height`` in the middle."""
    x, y = np.linspace(-1.0, 1.0, across + 1), np.linspace(0.0, 1.0, along + 1)
    X = np.array([[a, b, -height * (1.0 - a**2)] for b in y for a in x])
    k = across + 1
    i = np.array([[j * k + c for c in range(across)] for j in range(along)]).ravel()
    F = np.concatenate([np.stack([i, i + 1, i + k + 1], 1), np.stack([i, i + k + 1, i + k], 1)])
    planes = {
        Plane((0, 0, 0), (0, 1, 0), mirror=True): X[:, 1] == 0.0,
        Plane((0, 1, 0), (0, -1, 0), mirror=True): X[:, 1] == 1.0,
    }
    patch = Patch("strip", 1.0, 0.0, weight=weight)
    fixed = np.abs(X[:, 0]) == 1.0
    return Surface(X, F, np.zeros(len(F), int), [patch], fixed=fixed, on_planes=planes)


@pytest.mark.parametrize("weight", [0.8, *at_night(1.5)])
def test_strips_too_heavy_for_their_span_fold_in_the_weight(weight):
    result = solve(strip(weight))
    assert result.status is Status.NONE_FOUND
    fold = result.tried[-1]
    assert (fold.way, fold.end) == ("weight", "fold")
    assert fold.value * weight == pytest.approx(HEAVIEST, rel=0.01)
    assert f"folds at {fold.value:.3f} of the weight" in result.certificate.detail
    assert result.certificate.verdict is Verdict.NONE_FOUND


def test_a_strip_that_can_carry_its_weight_is_found_from_far_below():
    heavy = strip(0.6, height=4.0)
    assert not solve_once(heavy).converged
    result = solve(heavy)
    assert result.certificate.verdict is Verdict.STABLE
    assert result.energy == pytest.approx(solve(strip(0.6)).energy, rel=1e-6)


# ---- limits, faults and requests


@pytest.mark.parametrize("limit", [0, 1, 2])
def test_a_limit_of_iterations_is_one_for_the_whole_search(limit):
    steps = []
    surface = spherical_cap(0.25, alpha=0.45)
    tall = surface.moved(surface.vertices * [1.0, 1.0, 8.0])
    result = solve(tall, iterations=limit, callback=steps.append)
    assert result.status is Status.ITERATION_LIMIT
    assert result.iterations == limit
    assert len(steps) == limit + 1


def test_a_fault_on_a_branch_is_not_a_branch_that_does_not_start(monkeypatch):
    def broken(*_, **__):
        raise SurfaceError("a fault")

    monkeypatch.setattr(homotopy, "follow_until", broken)
    with pytest.raises(SurfaceError, match="a fault"):
        solve(spherical_cap(0.25, alpha=0.45))


def test_where_no_branch_starts_the_error_says_so():
    surface = solve_once(pyramid()).surface
    with pytest.raises(NoBranch, match="not at rest"):
        follow(pyramid(height=3.0), "roof", 2.0)
    with pytest.raises(NoBranch, match="changes no force"):
        follow(surface.rebuilt(fixed=range(5)), Direction(pressures={"roof": 1.0}), 2.0)


def by_next(_):
    next(iter(()))


class Empty:
    def __iter__(self):
        return self

    def __next__(self):
        raise StopIteration


def by_loop(_):
    next(Empty())


def helped(_):
    asked()


def asked():
    raise StopIteration


@pytest.mark.parametrize("method", ["newton", "nesterov", "lbfgs"])
def test_only_a_raised_stop_iteration_is_a_request(method):
    surface = pyramid()
    assert solve(surface, method, helped).status is Status.STOPPED
    for mistaken in (by_next, by_loop):
        with pytest.raises(RuntimeError, match=r"StopIteration out of next\(\)"):
            solve(surface, method, mistaken)


def test_the_same_holds_along_branches_and_in_a_search():
    at_rest = solve(pyramid()).surface
    assert follow(at_rest, "roof", 2.0, callback=helped).ending is Ending.STOPPED
    with pytest.raises(RuntimeError, match="StopIteration out of next"):
        follow(at_rest, "roof", 2.0, callback=by_next)

    def on_the_branch(progress):
        if progress.row["step"] == "branch":
            by_next(progress)

    with pytest.raises(RuntimeError, match="StopIteration out of next"):
        solve(spherical_cap(0.25, alpha=0.45), callback=on_the_branch)


def test_a_verdict_on_evidence_alone_is_not_that_of_a_search():
    alone = solve_once(strip(1.5)).certificate
    assert alone.verdict is Verdict.RAN_AWAY
    assert alone.tried == certify(strip(1.5)).tried == ()
