"""Refinement where it pays: size fields, where errors come from, and how a search for an accuracy ends."""

import sys

import numpy as np
import pytest
from refusals import refused
from scipy.spatial import cKDTree

import generators
import pcmc
from pcmc import Patch, Surface, Target, cli, solve, solve_to_accuracy
from pcmc.accuracy import adaptive, check_mesh, estimator
from pcmc.accuracy.adaptive import AccuracyStatus, goals_in
from pcmc.accuracy.estimator import _along, _edge_shares, _slope, error_shares, size_field
from pcmc.base.errors import MissingExtra, OptionError, SurfaceError
from pcmc.design.targets import measure
from pcmc.forces.functional import energy, volume
from pcmc.forces.second_variation import hessian
from pcmc.meshing.curve_cutting import limit_growth
from pcmc.meshing.held_curves import onto_held_curves
from pcmc.meshing.quality import edge_lengths, minimum_angle
from pcmc.meshing.refinement import refine
from pcmc.meshing.remeshing import remesh
from pcmc.plan import Divider, Plan
from pcmc.surface.geometry import angles, face_areas
from studies.orders import slope


def l_roof(edge_length: float = 1.5) -> Surface:
    """Two roofs over an L, their wall from the re-entrant corner straight to the other side."""
    outline = [[0, 0], [8, 0], [8, 4], [4, 4], [4, 8], [0, 8]]
    wall = Divider([[4, 4], [4, 0]], wall=1.0, bottom="held")
    return Plan(outline, dividers=[wall], tension=4.0, edge_length=edge_length).surface()


@pytest.fixture(scope="module")
def roof() -> Surface:
    return solve(l_roof()).surface


@pytest.fixture(scope="module")
def fine_roof(roof) -> Surface:
    return solve(refine(roof)).surface


def test_sizes_grow_no_faster_than_asked_and_stay_where_they_may():
    surface = generators.two_squares(6)
    X, edges = surface.vertices, surface.topology.edges
    wanted = np.random.default_rng(1).uniform(0.01, 2.0, surface.n)
    size = limit_growth(X, edges, wanted, 1.3)
    rise = np.abs(np.diff(size[edges], axis=1))[:, 0]
    assert (rise <= 0.3 * edge_lengths(surface) * (1 + 1e-12)).all()
    assert (size <= wanted).all()
    assert size.min() == wanted.min()
    np.testing.assert_allclose(limit_growth(X, edges, size, 1.3), size)


def test_remeshed_edges_follow_the_size_field(roof):
    corner = np.array([4.0, 4.0, 0.0])
    wanted = 0.1 + 0.3 * np.linalg.norm(roof.vertices - corner, axis=1)
    graded = remesh(roof, wanted, growth=1.4)
    middle = graded.vertices[graded.topology.edges].mean(axis=1)
    ratio = edge_lengths(graded) / (0.1 + 0.3 * np.linalg.norm(middle - corner, axis=1))
    assert 0.7 < np.median(ratio) < 1.4
    assert np.quantile(ratio, 0.99) < 2.5
    assert edge_lengths(graded).min() < 0.15
    sheets = graded.faces[~graded.walls[graded.patch_of_face]]
    assert angles(graded.vertices[sheets]).min() > 15.0
    assert graded.m < 0.2 * remesh(roof, 0.1).m
    gap = cKDTree(graded.vertices).query(roof.vertices[roof.topology.on_boundary])[0]
    assert gap.max() == 0.0


def test_new_boundary_vertices_lie_on_the_curve_that_is_given():
    cap = generators.spherical_cap(0.5)
    sizes = np.where(cap.vertices[:, 0] > 0.0, 0.1, 0.4)
    fine = remesh(cap, sizes, growth=1.5, project=onto_held_curves(cap))
    radius = np.linalg.norm(fine.vertices[fine.fixed], axis=1)
    np.testing.assert_allclose(radius, 1.0, atol=1e-5)
    assert fine.fixed.sum() > 1.5 * cap.fixed.sum()
    flat = remesh(cap, sizes, growth=1.5)
    assert np.linalg.norm(flat.vertices[flat.fixed], axis=1).min() < 0.999


def test_large_triangles_from_curve_to_curve_are_split():
    hall = solve(generators.bezier_hall(14.0)).surface
    place = [75.0, 52.0]  # between an arch and the hole
    fine = remesh(hall, 3.0 + 0.25 * np.linalg.norm(hall.vertices[:, :2] - place, axis=1), growth=1.5)
    middle = fine.vertices[fine.topology.edges].mean(axis=1)
    wanted = 3.0 + 0.25 * np.linalg.norm(middle[:, :2] - place, axis=1)
    assert (edge_lengths(fine) / wanted).max() < 3.5
    assert minimum_angle(fine) > 15.0


@pytest.mark.parametrize("wrong", [[1.0, 2.0], ["fine"], np.full(5, 0.5)])
def test_sizes_of_the_wrong_shape_are_refused(roof, wrong):
    with refused(OptionError, what="edge_length", expected=(roof.n,)):
        remesh(roof, wrong)


def test_a_size_that_is_not_positive_is_refused(roof):
    sizes = np.full(roof.n, 0.5)
    sizes[7] = np.nan
    with refused(OptionError, what="edge_length", where=7):
        remesh(roof, sizes)


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.CurveWarning")
@pytest.mark.parametrize("of", [0, 1, 2])
@pytest.mark.parametrize("quantity", ["reaction", "thrust"])
def test_slopes_of_reactions_are_derivatives_of_the_table_of_supports(roof, quantity, of):
    motion = np.random.default_rng(2).normal(size=roof.vertices.shape) * 1e-6

    def value(surface: Surface) -> float:
        supports = pcmc.certify(surface).supports
        force = supports.loc[supports["name"] == roof.patches[of].name, ["force_x", "force_y", "force_z"]]
        assert len(force) == 1
        x, y, z = force.to_numpy()[0].tolist()
        return z if quantity == "reaction" else float(np.hypot(x, y))

    ahead, back = (value(roof.moved(roof.vertices + s * motion)) for s in (1.0, -1.0))
    predicted = float((_slope(roof, quantity, roof.patches[of].name) * motion).sum())
    assert 0.5 * (ahead - back) == pytest.approx(predicted, rel=1e-4)


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.CurveWarning")
@pytest.mark.parametrize("quantity", ["reaction", "thrust"])
def test_slopes_of_the_reaction_of_a_line_inside(quantity):
    """A ridge of two sheets that ends on the boundary, whose vertices have their forces in other rows."""
    plan = Plan(
        [[0, 0], [6, 0], [6, 6], [0, 6]],
        [],
        tension=6.0,
        edge_length=1.2,
        supports=[[[3, 0, 0], [3, 3, 1]]],
    )
    tent = solve(plan.surface()).surface
    motion = np.random.default_rng(3).normal(size=tent.vertices.shape) * 1e-6

    def value(surface: Surface) -> float:
        row = pcmc.certify(surface).supports.set_index("name").loc["patch 1, inside"]
        return row["force_z"] if quantity == "reaction" else float(np.hypot(row["force_x"], row["force_y"]))

    ahead, back = (value(tent.moved(tent.vertices + s * motion)) for s in (1.0, -1.0))
    predicted = float((_slope(tent, quantity, "patch 1, inside") * motion).sum())
    assert 0.5 * (ahead - back) == pytest.approx(predicted, rel=1e-4)


def test_the_largest_pull_of_a_mesh_check_is_the_target(roof):
    heavy = roof.retensioned(weights={roof.patches[0].name: 0.5})
    slope = _slope(heavy, "reaction per length", "")
    np.testing.assert_array_equal(slope, measure(heavy, Target("reaction per length")).by_position)
    assert slope.any()


@pytest.mark.parametrize("quantity", ["energy", "volume", "area", "height", "reaction"])
def test_the_shares_add_up_to_the_error_and_not_to_much_more(roof, fine_roof, quantity):
    of = {"area": "wall", "height": roof.patches[0].name}.get(quantity, "")
    names = [patch.name for patch in roof.patches]
    of = next((n for n in names if n.startswith(of)), of) if of else of
    check = check_mesh(roof, 2)
    coarse, fine = check.surfaces
    assert quantity != "energy" or energy(fine) == pytest.approx(energy(fine_roof))
    values = [_value(s, quantity, of) for s in check.surfaces]
    total = float(error_shares(coarse, fine, {(quantity, of): 1.0}).sum())
    assert abs(values[1] - values[0]) < 3.0 * total
    if quantity in ("energy", "volume"):
        assert total < 3.0 * abs(values[1] - values[0])


def _value(surface: Surface, quantity: str, of: str) -> float:
    return float(check_mesh(surface, 2).row(quantity, of).value)


def test_held_vertices_that_move_outward_change_the_volume_by_their_shares(monkeypatch):
    cap = solve(generators.spherical_cap(0.4, alpha=0.6)).surface
    fine = solve(refine(cap)).surface
    new = fine.fixed & (np.arange(fine.n) >= cap.n)
    outward = np.where(new[:, None], fine.vertices * [1.0, 1.0, 0.0], 0.0)
    ahead, back = (volume(solve(fine.moved(fine.vertices + s * outward)).surface) for s in (1e-4, -1e-4))
    monkeypatch.setattr(estimator, "_interpolation_error", lambda *_: outward)
    (shares,) = _edge_shares(cap, fine, [("volume", "")])
    # not exact, as vertices only rest along the normals
    assert shares.sum() == pytest.approx((ahead - back) / 2e-4, rel=5e-3)


def test_shares_are_largest_at_the_re_entrant_corner_and_scale_with_the_accuracy(roof, fine_roof):
    wall = roof.patches[-1].name
    one = error_shares(roof, fine_roof, {("reaction", wall): 1.0})
    two = error_shares(roof, fine_roof, {("reaction", wall): 0.5})
    np.testing.assert_allclose(two, 2.0 * one)
    middle = roof.vertices[roof.faces[one.argmax()]].mean(axis=0)
    assert np.linalg.norm(middle[:2] - 4.0) < 1.5


def test_the_lowest_eigenvalue_has_shares(roof, fine_roof):
    shares = error_shares(roof, fine_roof, {("lowest eigenvalue", ""): 1.0})
    assert (shares >= 0.0).all()
    assert shares.max() > 0.0


def test_the_change_of_forces_along_a_field_is_that_of_the_hessian():
    """And the second one is how the Hessian's product changes."""
    cap = generators.spherical_cap(0.6)
    field = np.random.default_rng(0).normal(size=cap.vertices.shape)

    def product(step):
        return (hessian(cap.moved(cap.vertices + step * field)) @ field.ravel()).reshape(-1, 3)

    np.testing.assert_allclose(_along(cap, field), product(0.0), rtol=1e-5, atol=1e-6)
    bent = (product(1e-4) - product(-1e-4)) / 2e-4
    np.testing.assert_allclose(_along(cap, field, second=True), bent, atol=3e-3 * np.abs(bent).max())


def test_equal_shares_lead_to_equal_edges_and_the_number_asked_for():
    cap = generators.spherical_cap(0.5)
    size = size_field(cap, face_areas(cap.vertices[cap.faces]) ** 2, 400)
    assert size.max() < 1.1 * size.min()
    assert 320 < remesh(cap, size).m < 500
    assert size_field(cap, np.zeros(cap.m), 400).min() > 0.0


def test_the_next_mesh_has_the_triangles_that_equal_shares_need(roof, monkeypatch):
    """Where a quarter of the triangles has no share in the error, equal shares need 3/4 of the triangles."""
    asked, bar = [], check_mesh(roof).row("volume").error

    def shares(surface, fine, goals):
        return np.where(np.arange(surface.m) < surface.m / 4, 0.0, 1.0)

    def sizes(surface, shares, triangles):
        asked.append(triangles / surface.m)
        raise KeyboardInterrupt

    monkeypatch.setattr(adaptive, "error_shares", shares)
    monkeypatch.setattr(adaptive, "size_field", sizes)
    found = solve_to_accuracy(roof, {"volume": bar / 1.8})
    assert found.status is AccuracyStatus.STOPPED
    assert asked == pytest.approx([adaptive.SPARE * 0.75 * 1.8], rel=0.02)


def test_evenness_is_the_least_error_of_as_many_triangles():
    """A triangle cut into k leaves 1/k of its share: Σ η/k is least for k in proportion to √η."""
    random = np.random.default_rng(0)
    shares = random.uniform(0.1, 9.0, 20)
    best = estimator.evenness(shares) * shares.sum()
    cuts = 20.0 * np.sqrt(shares) / np.sqrt(shares).sum()
    assert (shares / cuts).sum() == pytest.approx(best, rel=1e-12)
    for other in np.abs(cuts + random.normal(scale=0.1, size=(50, 20))):
        assert (shares / (20.0 * other / other.sum())).sum() > best


@pytest.mark.nightly
def test_order_two_is_regained_at_a_re_entrant_corner():
    start = solve(l_roof(2.0)).surface
    wall = start.patches[-1].name
    found = solve_to_accuracy(start, {f"area of {wall}": 1e-12}, most_triangles=3000)
    limit = found.values.limit[0]
    uniform, surface = [], start
    for _ in range(4):
        surface = solve(surface).surface
        area = float(pcmc.certify(surface).patches.set_index("patch").area[wall])
        uniform.append((surface.m, abs(area - limit)))
        surface = refine(surface)
    graded = found.history[["triangles", "value"]].to_numpy()
    graded[:, 1] = np.abs(graded[:, 1] - limit)
    orders = [slope(m[1:] ** -0.5, e[1:]).order for m, e in (np.array(uniform).T, graded.T)]
    assert orders[0] < 1.5
    assert orders[1] > 1.9
    assert graded[-1, 1] < 0.25 * np.interp(graded[-1, 0], *np.array(uniform).T)


def test_a_patch_alone_and_several_quantities():
    name = l_roof().patches[0].name
    found = solve_to_accuracy(l_roof(), {f"height of {name}": 0.05, "volume": 8.0}, accuracy_of="limit")
    assert found.reached
    assert found.values["quantity"].tolist() == ["height", "volume"]
    assert (found.values["limit_error"] <= found.values["accuracy"]).all()
    assert found.surface is found.check.surfaces[0]
    assert found.history["round"].max() == len(found.surfaces)
    assert f"height of {name}" in found.message


@pytest.mark.nightly
def test_an_end_of_a_junction_that_the_mesh_holds_has_no_limit():
    found = solve_to_accuracy(generators.two_caps(1.6), "height=1e-2", most_triangles=4000)
    assert found.status is AccuracyStatus.NO_LIMIT
    assert "held" in found.detail
    assert len(found.surfaces) == adaptive.PATIENCE


def test_the_limit_of_triangles():
    found = solve_to_accuracy(l_roof(), "height=1e-7", most_triangles=300)
    assert found.status is AccuracyStatus.TRIANGLES
    assert "most_triangles" in found.detail
    assert found.surface.m < 450


def test_no_equilibrium_and_too_many_rounds(monkeypatch):
    weak = l_roof().retensioned({patch.name: 0.5 for patch in l_roof().patches})
    found = solve_to_accuracy(weak, "height=0.1")
    assert found.status is AccuracyStatus.NOT_AT_REST
    assert found.check is None
    assert not len(found.history)
    monkeypatch.setattr(adaptive, "ROUNDS", 1)
    assert solve_to_accuracy(l_roof(), "height=1e-4").status is AccuracyStatus.ROUNDS


def test_stopped_on_request():
    rows = []

    def stop(row):
        rows.append(row)
        raise StopIteration

    found = solve_to_accuracy(l_roof(), "height=1e-4", callback=stop)
    assert found.status is AccuracyStatus.STOPPED
    assert len(found.surfaces) == len(rows) == 1
    assert rows[0]["excess"] > 1.0


@pytest.mark.parametrize(
    ("accuracy", "what"),
    [
        ({"hight": 1e-3}, "quantity"),
        ("height", "accuracy"),
        ("height=small", "accuracy"),
        ("=1", "accuracy"),
        ({}, "accuracy"),
        (1e-3, "accuracy"),
        ({"height": 0.0}, "accuracy"),
        ("volume=-1", "accuracy"),
        ({"height": np.nan}, "accuracy"),
        ({"height": True}, "accuracy"),
    ],
)
def test_a_wrong_accuracy_is_refused(accuracy, what):
    with refused(OptionError, what=what):
        solve_to_accuracy(l_roof(), accuracy)


def test_other_wrong_arguments_are_refused():
    with refused(SurfaceError, what="surface"):
        solve_to_accuracy(None, "height=1")
    with refused(OptionError, what="accuracy_of", found="mash"):
        solve_to_accuracy(l_roof(), "height=1", accuracy_of="mash")
    with refused(OptionError, what="boundary", found="round"):
        solve_to_accuracy(l_roof(), "height=1", boundary="round")
    with refused(OptionError, what="most_triangles", found=0):
        solve_to_accuracy(l_roof(), "height=1", most_triangles=0)
    with refused(OptionError, what="patch", found="nort"):
        solve_to_accuracy(l_roof(), "height of nort=1")


def test_a_quantity_that_the_surface_lacks(roof):
    with refused(OptionError, what="accuracy", found="height of wall 1"):
        goals_in(check_mesh(roof, 2).table, {"height of wall 1": 1.0})


def test_without_mmgpy_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "mmgpy", None)
    with pytest.raises(MissingExtra, match=r"pcmc-surfaces\[remesh\]"):
        solve_to_accuracy(l_roof(), "height=0.1")


PROJECT = """
[plan]
outline = [[0, 0], [4, 0], [4, 3], [0, 3]]
edge_length = 1.0
patches = {roof = {tension = 4.0}}
[solve]
accuracy = {height = 0.02}
[output]
files = ["roof.pcmc"]
"""


def test_a_project_asks_for_an_accuracy(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(PROJECT, encoding="utf-8")
    assert cli.main(["solve", "roof.toml"]) == 0
    out = capsys.readouterr().out
    assert "accuracy reached" in out
    assert "persists" in out
    fine = pcmc.read(tmp_path / "roof.pcmc")
    assert check_mesh(fine).row("height", "roof").error <= 0.02
    assert cli.main(["solve", "roof.toml", "--accuracy", "height=1e-9", "--most-triangles", "100"]) == 1
    out = capsys.readouterr().out
    assert "within the limit of triangles" in out
    assert "nothing written" in out
    assert cli.main(["solve", "roof.toml", "--accuracy", "hight=1"]) == 2
    assert "did you mean 'height'" in capsys.readouterr().err
    (tmp_path / "roof.toml").write_text(PROJECT.replace("height", "hight"), encoding="utf-8")
    assert cli.main(["solve", "roof.toml"]) == 2
    assert "solve: unknown quantity 'hight'" in capsys.readouterr().err


def test_targets_are_met_on_the_mesh_of_the_accuracy(tmp_path):
    targets = '\n[targets]\nmeet = [{quantity = "apex", of = "roof", value = 0.4}]\nvary = ["roof"]\n'
    (tmp_path / "roof.toml").write_text(PROJECT.replace("0.02", "0.05") + targets, encoding="utf-8")
    outcome = pcmc.project.run(tmp_path / "roof.toml")
    assert outcome.good
    assert outcome.accurate.reached
    assert outcome.design.met
    assert outcome.surface.vertices[:, 2].max() == pytest.approx(0.4, rel=1e-6)
    assert outcome.surface.m == outcome.accurate.surface.m


def test_a_patch_without_a_name_of_its_own_is_not_confused():
    pair = Surface(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 1, 2], [0, 2, 3]],
        [0, 1],
        [Patch("a", 1.0), Patch("near", 1.0)],
        fixed=range(4),
    )
    with refused(OptionError, what="patch", found="b"):
        adaptive.check_places({"area of b": 1.0}, pair)
    with refused(OptionError, what="patch", found="b"):
        adaptive.check_places({"reaction of a | b": 1.0}, pair)
    adaptive.check_places({"area of near": 1.0, "reaction of a near (1, 2, 3)": 1.0}, pair)
    adaptive.check_places({"reaction of a | near": 1.0, "reaction of a, inside near (1, 2)": 1.0}, pair)
