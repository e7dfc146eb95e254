"""Cables: energy and derivatives, motion space, closed forms, balance, meshes and files that carry them."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from cable_cases import net
from hypothesis import given, settings
from hypothesis import strategies as st
from programs import needs_evolver
from refusals import refused
from shapes import rotation, three_patches

import pcmc
from generators import hypar_roof, hypar_roof_edge
from generators.grid import grid_faces
from pcmc import Cable, Direction, Parameter, Patch, Plane, Surface, Target, Verdict, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.certificate.balance import load_ratio, unbalanced
from pcmc.certificate.quantities import figures
from pcmc.design.targets import measure
from pcmc.forces.functional import energy_and_gradient, energy_at
from pcmc.forces.motion_space import vertex_classes
from pcmc.forces.second_variation import hessian
from pcmc.meshing.local_refinement import refine_near
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import remesh
from pcmc.solvers.evaluate import Evaluator
from pcmc.surface.topology import CURVE, POINT, SHEET
from studies.reference import evolver

ALONE = {"a": 0.0, "b": 0.0}
TERMS = {
    "cables": lambda: net().retensioned(weights=ALONE),
    "weights": lambda: net().retensioned(cables=dict.fromkeys(("edge", "ridge", "between"), 0.0)),
    "both": net,
}


@pytest.fixture(scope="module")
def roof():
    return solve(hypar_roof(8, weight=0.05), tolerance=1e-12).surface


# ---- energy -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TERMS)
def test_taylor_slopes_of_energy_and_derivatives(name):
    surface = TERMS[name]()
    X, d = surface.vertices, np.random.default_rng(1).standard_normal((surface.n, 3))
    E, g = energy_and_gradient(surface, supports=False)
    first, second = float((g * d).sum()), float(d.ravel() @ (hessian(surface) @ d.ravel()))
    steps = 3e-4 * 0.5 ** np.arange(3)
    change = np.array([energy_at(surface, X + t * d) - E for t in steps])
    for left, order in (change - steps * first, 2), (change - steps * first - 0.5 * steps**2 * second, 3):
        slopes = np.log2(np.abs(left[:-1] / left[1:]))
        assert slopes == pytest.approx(order, abs=0.05)


def test_a_cable_alone_has_its_closed_form():
    """Between two fixed points 2 apart, a vertex at height h: E = 2 τ √(1 + h²), force 2 τ h / √(1 + h²)."""
    X = [[-1, 0, 0], [1, 0, 0], [0, 0, 0.75]]
    one = Surface(
        X, [[0, 1, 2]], [0], [Patch("a", 1e-6, 0.0)], [0, 1], cables=[Cable("c", 3.0, [[0, 2], [1, 2]])]
    )
    assert pcmc.energy(one) == pytest.approx(7.5, abs=1e-5)
    assert pcmc.gradient(one)[2] == pytest.approx([0.0, 0.0, 3.6], abs=1e-5)


def test_evaluator_is_the_functional():
    point = Evaluator(net())(net().vertices)
    assert point.energy == pytest.approx(pcmc.energy(net()), rel=1e-14)
    np.testing.assert_allclose(point.gradient, pcmc.gradient(net()), atol=1e-14)


@needs_evolver
@pytest.mark.parametrize("name", TERMS)
def test_the_reference_program_agrees(name):
    """Its forces of line tensions are those of the energy only where all patches have one pressure."""
    surface = TERMS[name]()
    if surface.cable_edges.ends.size:
        surface = surface.retensioned(pressures={"b": 0.5})
    assert evolver.energy(surface) == pytest.approx(pcmc.energy(surface), rel=1e-12)
    expected = pcmc.gradient(surface)
    np.testing.assert_allclose(evolver.gradient(surface), expected, rtol=0, atol=1e-12 * abs(expected).max())


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_rigid_motions_and_labels_do_not_matter(seed):
    surface, rng = net(), np.random.default_rng(seed)
    R, shift, order = rotation(seed), rng.uniform(-3, 3, 3), rng.permutation(surface.n)
    new = np.argsort(order)
    other = dataclasses.replace(
        surface,
        vertices=surface.vertices[order] @ R.T + shift,
        faces=new[surface.faces],
        fixed=surface.fixed[order],
        plane=Plane(shift + R @ surface.plane.point, R @ surface.plane.normal),
        cables=[Cable(c.name, c.tension, new[c.edges]) for c in surface.cables[::-1]],
        on_plane=(),
    )
    assert pcmc.energy(other) == pytest.approx(pcmc.energy(surface), rel=1e-12)
    np.testing.assert_allclose(pcmc.gradient(other), pcmc.gradient(surface)[order] @ R.T, atol=1e-11)


# ---- motion space -------------------------------------------------------------------------------


def test_a_cable_is_a_curve_and_its_ends_are_points():
    surface = net()
    kind = vertex_classes(surface).kind
    edge, ridge, between = (np.arange(25).reshape(5, 5)[k] for k in ((0,), (slice(None), 1), (2,)))
    assert kind[[6, 11, 16]].tolist() == [POINT, POINT, POINT]  # two ends, and where it meets a cable
    assert (kind[between[1]], kind[between[2]]) == (POINT, CURVE)
    assert kind[7] == SHEET
    assert (kind[edge.ravel()[1:-1]] == CURVE).all()
    assert ridge[2] == 11
    part = dataclasses.replace(surface, cables=[Cable("half", 2.0, [[0, 1], [1, 2]])])
    assert vertex_classes(part).kind[2] == POINT  # there the tension along the edge changes


def test_a_cable_of_tension_0_changes_nothing():
    slack = TERMS["weights"]()
    without = dataclasses.replace(slack, cables=())
    assert pcmc.energy(slack) == pcmc.energy(without)
    np.testing.assert_array_equal(pcmc.gradient(slack), pcmc.gradient(without))
    np.testing.assert_array_equal(vertex_classes(slack).kind, vertex_classes(without).kind)
    assert not len(pcmc.certify(slack).cables)


# ---- equilibria ---------------------------------------------------------------------------------


def test_free_edges_of_a_flat_membrane_are_arcs_of_radius_tension_over_tension():
    errors = []
    for squares in (4, 8, 16):
        flat = solve(hypar_roof(squares, height=0.0)).surface
        errors.append(hypar_roof_edge(flat.vertices[np.unique(flat.cables[0].edges)]).max())
    assert errors[-1] < 1e-3
    assert [np.log2(a / b) for a, b in pairwise(errors)] == pytest.approx([2.0, 2.0], abs=0.1)


def test_a_cable_pulls_on_its_ends_along_its_tangent_there():
    """Arcs of radius 10 over the sides of length 10: cos 30° and sin 30° of the tension of 10."""
    errors = []
    for squares in (6, 12):
        ends = pcmc.certify(solve(hypar_roof(squares, height=0.0)).surface).cable_ends
        forces = np.sort(ends[["force_x", "force_y"]].abs().to_numpy())
        errors.append(np.abs(forces - [5.0, 75.0**0.5]).max())
    assert errors[-1] < 0.05
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.35)


def test_a_cable_has_a_kink_where_another_one_holds_it():
    """Two ropes of 10 and one of 8 over a film that hardly pulls: all three are straight."""
    ropes = [pcmc.Cable("a", 10.0, [[0, 3], [3, 1]]), pcmc.Cable("b", 8.0, [[3, 2]])]
    corners = [[-2, 0, 0], [2, 0, 0], [0, -3, 0], [0, -1, 0]]
    film = pcmc.Surface(corners, [[0, 2, 3], [2, 1, 3]], [0, 0], [pcmc.Patch("film", 1e-6, 0.0)],
                        fixed=range(3), cables=ropes)  # fmt: skip
    certificate = pcmc.certify(solve(film).surface)
    held = certificate.cable_ends.query("held")[["force_x", "force_y"]]
    assert held.to_numpy() == pytest.approx(np.array([[-(84**0.5), 4], [84**0.5, 4], [0, -8]]), abs=1e-5)
    assert certificate.cables.cable_pull.max() < 1e-12


def test_a_hypar_roof_on_four_masts_is_stable(roof):
    certificate = pcmc.certify(roof)
    assert certificate.verdict is Verdict.STABLE
    cables, ends = certificate.cables, certificate.cable_ends
    assert cables.cable.tolist() == ["south", "east", "north", "west"]
    assert (cables.force_left < 1e-9).all()
    np.testing.assert_allclose(np.linalg.norm(ends[["force_x", "force_y", "force_z"]], axis=1), 10.0)
    assert ends.held.all()
    assert len(ends) == 8
    assert certificate.load == pytest.approx(-0.05 * certificate.patches.area[0], rel=1e-12)
    assert certificate.support == pytest.approx(-certificate.load, rel=0.02)
    assert "cable" in str(certificate)


def test_along_a_free_edge_the_cable_balances_the_sheet():
    """α = τ κ: the two columns approach each other as the square of the edge length."""
    gaps = []
    for squares in (6, 12):
        table = pcmc.certify(solve(hypar_roof(squares)).surface).cables
        gaps.append(float(np.abs(table.sheet_pull - table.cable_pull).max()))
    assert gaps[1] < 2e-3
    assert np.log2(gaps[0] / gaps[1]) == pytest.approx(2.0, abs=0.35)


def test_a_cable_where_nothing_else_acts_is_named():
    X = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]]
    faces, patches = (
        [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]],
        [Patch("a", 1.0, 0.0), Patch("off", 0.0, 0.0)],
    )
    rope = Cable("rope", 2.0, [[1, 2], [4, 5]])
    surface = Surface(X, faces, [0, 0, 1, 1], patches, fixed=[0, 3, 4], cables=[rope])
    for use in (solve, pcmc.certify):
        with refused(SurfaceError, what="cables", where=(4, 5)):
            use(surface)
    kept = dataclasses.replace(surface, cables=[Cable("rope", 2.0, [[0, 1], [1, 2]])])
    assert len(pcmc.certify(kept).cables) == 1


def test_a_cable_around_a_disc_has_a_row_without_ends():
    """τ κ = 3/2 along a polygon on a circle of radius 2, where the sheet pulls with α = 1."""
    angle = 2.0 * np.pi * np.arange(12) / 12
    X = [[0, 0, 0], *np.stack([2.0 * np.cos(angle), 2.0 * np.sin(angle), 0.0 * angle], axis=1)]
    faces = [[0, k + 1, (k + 1) % 12 + 1] for k in range(12)]
    rim = Cable("rim", 3.0, [face[1:] for face in faces])
    disc = Surface(X, faces, [0] * 12, [Patch("disc", 1.0, 0.0)], fixed=[0], cables=[rim])
    certificate = pcmc.certify(disc)
    (row,) = certificate.cables.to_dict("records")
    assert (row["cable"], row["tension"], len(certificate.cable_ends)) == ("rim", 3.0, 0)
    assert row["length"] == pytest.approx(48.0 * np.sin(np.pi / 12), rel=1e-12)
    assert row["sheet_pull"] == pytest.approx(1.0, rel=1e-12)
    assert row["cable_pull"] == pytest.approx(1.5, rel=1e-12)
    assert [row[f"middle_{axis}"] for axis in "xyz"] == [0.0, 0.0, 0.0]


def test_a_ridge_cable_between_equal_sheets_pulls_them_down():
    """A cable along the middle of a dome, its ends fixed: it is a curve where the sheet has a crease."""
    side = np.linspace(-1.0, 1.0, 9)
    X = np.array([[x, y, 0.3 * (1 - x * x) * (1 - y * y)] for x in side for y in side])
    rim = np.abs(X[:, :2]).max(axis=1) == 1.0
    middle = np.flatnonzero(X[:, 0] == 0.0)
    dome = Surface(X, grid_faces(8, 8), [0] * 128, [Patch("dome", 1.0)], fixed=rim)
    low = dataclasses.replace(dome, cables=[Cable.along("ridge", 0.5, middle)], on_plane=())
    free, tied = solve(dome), solve(low)
    assert tied.converged
    certificate = pcmc.certify(tied.surface)
    assert certificate.verdict is Verdict.STABLE
    assert certificate.residual < 1e-10
    assert tied.surface.vertices[middle, 2].max() < 0.8 * free.surface.vertices[middle, 2].max()


def test_other_solvers_know_cables_and_weights():
    start = hypar_roof(4, weight=0.1)
    lowest = solve(start).energy
    for method in ("lbfgs", "nesterov"):
        run = (
            solve(start, method, evaluations=60) if method == "lbfgs" else solve(start, method, iterations=60)
        )
        assert run.energy < pcmc.energy(start)
        assert run.energy == pytest.approx(lowest, rel=2e-3)


def test_a_cable_too_short_of_tension_is_named():
    certificate = solve(hypar_roof(6, height=0.0, cable=4.0)).certify()
    assert certificate.verdict is pcmc.Verdict.NO_EQUILIBRIUM  # it is flat: a theorem
    assert "4 < α L / (2 sin(φ/2)) = 7.071, L = 10, φ = 90°" in certificate.detail
    certificate = solve(hypar_roof(6, height=1.0, cable=4.0)).certify()
    assert not certificate.certified
    assert "more than 2 τ/α = 8" in certificate.detail


def test_a_free_edge_carries_nothing():
    """One square, held along one side; the load ratio counts that side and the cables' ends at it."""
    X = [[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]]
    sheet = Surface(X, [[0, 2, 3], [0, 3, 1]], [0, 0], [Patch("a", 3.0, 1.0)], fixed=[0, 1])
    assert load_ratio(sheet) == pytest.approx(1.0 / 3.0)
    tied = dataclasses.replace(sheet, cables=[Cable.along("edge", 5.0, [0, 2, 3, 1])], on_plane=())
    assert load_ratio(tied) == pytest.approx(1.0 / 13.0)


def test_tensions_at_a_junction_with_a_cable_prove_nothing():
    surface = three_patches()
    strong = surface.retensioned({surface.patches[0].name: 50.0})
    pinchable = np.zeros(len(surface.patches), dtype=bool)
    proof = unbalanced(strong, pinchable)
    assert proof is not None
    curve = [c for c in strong.topology.junctions if not strong.held[c.vertices].all()]
    cables = [Cable.along(f"c{k}", 1.0, c.vertices, c.closed) for k, c in enumerate(curve)]
    assert unbalanced(dataclasses.replace(strong, cables=cables), pinchable) is None


# ---- design and continuation --------------------------------------------------------------------


def test_sensitivities_are_the_limits_of_differences(roof):
    named = {"sag": "south", "length": "east", "force": "east", "area": "roof"}
    targets = [Target(quantity, of) for quantity, of in named.items()]
    parameters = [Parameter("south", "cable"), Parameter("east", "cable"), Parameter("roof", "weight")]
    table = pcmc.sensitivities(roof, targets, parameters)
    for parameter in parameters:
        h, name = 1e-4, f"{parameter.kind}s"
        ends = [
            solve(roof.retensioned(**{name: {parameter.patch: parameter.value(roof) + s}}), min_quality=0.0)
            for s in (h, -h)
        ]
        values = np.array([[measure(end.surface, t).value for t in targets] for end in ends])
        expected = (values[0] - values[1]) / (2.0 * h)
        np.testing.assert_allclose(table[parameter.label], expected, rtol=2e-6, atol=1e-8)


def test_the_sag_is_met_as_a_target():
    targets = [Target("sag", name, 2.0) for name in ("south", "east", "north", "west")]
    vary = [Parameter(target.of, "cable") for target in targets]
    design = pcmc.meet(hypar_roof(8), targets, vary, tolerance=1e-9)
    assert design.met
    for target in targets:
        assert measure(design.surface, target).value == pytest.approx(2.0, abs=1e-8)


def test_the_tension_of_cables_can_be_followed(roof):
    names = [cable.name for cable in roof.cables]
    branch = pcmc.follow(roof, Direction(cables=dict.fromkeys(names, 1.0)), stop=15.0)
    assert branch.points.parameter.iloc[-1] == pytest.approx(15.0)
    assert branch.last.cables[0].tension == pytest.approx(15.0)
    length = sum(measure(branch.last, Target("length", name)).value for name in names)
    before, last = branch.points.iloc[-2], branch.points.iloc[-1]
    slope = (last.energy - before.energy) / (last.parameter - before.parameter)
    assert slope == pytest.approx(length, rel=0.01)


@pytest.mark.parametrize("quantity", ["sag", "length", "force"])
def test_quantities_of_cables_have_taylor_slope_two(roof, quantity):
    found = measure(roof, Target(quantity, "south"))
    d = np.random.default_rng(0).standard_normal(roof.vertices.shape)
    slope, left = float((found.by_position * d).sum()), []
    for t in (1e-4, 1e-5):
        moved = measure(roof._with(vertices=roof.vertices + t * d), Target(quantity, "south")).value
        left.append(abs(moved - found.value - t * slope))
    assert left[1] < 0.02 * left[0] + 1e-12


def test_key_figures_have_the_lengths_and_sags_of_cables(roof):
    shown = {(f.quantity, f.of): f.value for f in figures(roof, pcmc.certify(roof)) if f.owner == "cable"}
    for cable in roof.cables:
        for quantity in ("length", "sag", "force"):
            expected = measure(roof, Target(quantity, cable.name)).value
            assert shown[quantity, cable.name] == pytest.approx(expected, rel=1e-12)


def test_a_closed_cable_has_no_sag():
    X = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    ring = Surface(
        X, [[0, 1, 2]], [0], [Patch("a", 1.0)], [0], cables=[Cable.along("r", 1.0, [0, 1, 2], True)]
    )
    with refused(OptionError, what="of", found="r"):
        measure(ring, Target("sag", "r"))


# ---- meshes and files ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    "finer",
    [refine, lambda s: refine_near(s, [-5, -5, 4], 2, 4.0), lambda s: remesh(s, 0.8)],
    ids=["refine", "refine_near", "remesh"],
)
def test_finer_meshes_keep_their_cables(roof, finer):
    fine = finer(roof)
    for old, new in zip(roof.cables, fine.cables, strict=True):
        assert (new.name, new.tension) == (old.name, old.tension)
        assert len(new.edges) >= len(old.edges)
        old_length, new_length = (measure(s, Target("length", old.name)).value for s in (roof, fine))
        assert new_length == pytest.approx(old_length, rel=1e-12)
    assert sum(len(c.edges) for c in fine.cables) > sum(len(c.edges) for c in roof.cables)
    assert pcmc.certify(solve(fine).surface).verdict is Verdict.STABLE


@pytest.mark.parametrize("suffix", [".pcmc", ".fe"])
def test_files_carry_cables_and_weights(tmp_path, suffix):
    surface, path = net(), tmp_path / f"net{suffix}"
    pcmc.write(path, surface)
    again = pcmc.read(path)
    assert [(c.name, c.tension, c.edges.tolist()) for c in again.cables] == [
        (c.name, c.tension, c.edges.tolist()) for c in surface.cables
    ]
    assert again.weights.tolist() == surface.weights.tolist()
    assert pcmc.energy(again) == pytest.approx(pcmc.energy(surface), rel=1e-14)


@needs_evolver
def test_dumps_of_the_reference_program_are_read(tmp_path):
    evolver.run(net(), f'dump "{tmp_path / "net.dmp"}"')
    again = pcmc.read(tmp_path / "net.dmp")
    assert [c.tension for c in again.cables] == [2.0, 1.0, 0.5]
    assert again.weights.tolist() == [0.7, -0.3]


def test_the_certificate_of_cables_is_written(tmp_path, roof):
    pcmc.write(tmp_path / "roof.pcmc", roof, certificate=pcmc.certify(roof))
    assert len(pcmc.io.load(tmp_path / "roof.pcmc").certificate["cables"]) == 4


# ---- bad input ----------------------------------------------------------------------------------


def test_a_cable_on_an_edge_that_is_not_there_is_refused():
    with refused(SurfaceError, what="cable 'x': edges", found=[0, 24]):
        dataclasses.replace(net(), cables=[Cable("x", 1.0, [[0, 24]])])


@pytest.mark.parametrize("tension", [-1.0, np.nan])
def test_a_tension_that_is_none_is_refused(tension):
    with refused(SurfaceError, what="tension", where="x"):
        Cable("x", tension, [[0, 1]])


def test_a_cable_that_carries_nothing_but_itself_is_refused():
    surface = hypar_roof(4).retensioned({"roof": 0.0})
    with refused(SurfaceError, what="cables"):
        solve(surface)
