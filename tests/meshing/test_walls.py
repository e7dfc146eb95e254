"""Walls under the borders of any mesh, and labelled meshes as surfaces."""

import numpy as np
import pytest
from refusals import refused

import pcmc
from generators import hypar_roof, lens, two_squares
from pcmc import Plane, Surface
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.base.units import Units
from pcmc.drawings import drawing_set
from pcmc.explore.page_data import _controls, outline
from pcmc.forces.functional import patch_areas
from pcmc.meshing.quality import minimum_angle
from pcmc.plan import Divider, Plan, add_walls, surface_from_labels
from pcmc.report.tables import table_of_patches
from pcmc.solvers.continuation import Direction
from pcmc.surface.colours import SHEETS, patch_colors, rgb

BOX = [[0, 0], [8, 0], [8, 6], [0, 6]]


def grid(n: int = 8, height=lambda x, y: 0 * x) -> tuple[np.ndarray, np.ndarray]:
    """A square [-1,1]² of n² squares, each cut in two; height 0 on its rim if ``height`` is."""
    t = np.linspace(-1, 1, n + 1)
    x, y = np.meshgrid(t, t, indexing="ij")
    X = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    return X, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def bump(x, y):
    return 0.8 * (1 - x**2) * (1 - y**2)


def quarters(X, F) -> np.ndarray:
    middle = X[F].mean(axis=1)
    return 2 * (middle[:, 0] > 0) + (middle[:, 1] > 0)


def bare(*dividers) -> Surface:
    seams = [Divider(d, wall=None) for d in dividers]
    return Plan(BOX, seams, tension=4.0, edge_length=0.5).surface()


def line_of(surface: Surface):
    """The vertical line at which walls meet."""
    walls = {k for k, p in enumerate(surface.patches) if p.auxiliary}
    return [c for c in surface.topology.junctions if set(c.sheets) <= walls]


def test_walls_of_a_mesh_stand_on_the_plane_under_its_border():
    surface = add_walls(bare([[4, 0], [4, 6]]), 1.5, bottom="sliding")
    wall = surface.patches[-1]
    assert (wall.name, wall.tension, wall.pressure) == ("wall-patch 1-patch 2", 1.5, 0.0)
    assert minimum_angle(surface) > 24.0
    assert not surface.topology.seam_edge.any()
    faces = surface.faces[surface.patch_of_face == 2]
    X = surface.vertices
    np.testing.assert_allclose(X[np.unique(faces), 0], 4.0)
    across = np.cross(X[faces[:, 1]] - X[faces[:, 0]], X[faces[:, 2]] - X[faces[:, 0]])
    assert (across[:, 0] > 0).all()  # from patch 1 to patch 2
    top = surface.topology.junctions[0].vertices
    y, z = X[top, 1], X[top, 2]
    under = abs(float(np.sum(0.5 * (z[1:] + z[:-1]) * np.diff(y))))
    assert patch_areas(surface)[2] == pytest.approx(under, rel=1e-12)
    foot = surface.on_plane
    assert foot.sum() == len(top) - 2
    np.testing.assert_allclose(X[foot, 2], 0.0)
    np.testing.assert_allclose(np.sort(X[foot, 1]), np.sort(y)[1:-1])


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("first", [0, 1])
def test_a_walls_normals_point_from_its_first_patch_to_its_second(axis, first):
    X, F = grid(6, bump)
    side = (X[F].mean(axis=1)[:, axis] > 0).astype(int)
    order = np.argsort(side != first, kind="stable")  # the first label to come is patch 0
    surface = surface_from_labels(X, F[order], side[order], tension=2.0, walls=1.0)
    faces = surface.faces[surface.patch_of_face == 2]
    Y = surface.vertices
    across = np.cross(Y[faces[:, 1]] - Y[faces[:, 0]], Y[faces[:, 2]] - Y[faces[:, 0]])[:, axis]
    assert (np.sign(across) == (1 if first == 0 else -1)).all()


def test_walls_that_meet_share_their_line_and_its_rows():
    surface = add_walls(bare([[4, 0], [4, 3]], [[4, 3], [0, 6]], [[4, 3], [8, 6]]))
    (line,) = line_of(surface)
    assert len(set(line.sheets)) == 3
    heights = surface.vertices[line.vertices, 2]
    rows = np.diff(np.sort(heights))
    np.testing.assert_allclose(rows, rows[0])
    assert 0.35 < rows[0] < 0.75


def test_held_bottoms_and_chosen_borders():
    flat = bare([[3, 0], [3, 6]], [[6, 0], [6, 6]])
    surface = add_walls(flat, {("patch 2", "patch 1"): 2.0}, bottom="held")
    assert [p.name for p in surface.patches[3:]] == ["wall-patch 1-patch 2"]
    assert not surface.on_plane.any()
    assert surface.fixed.sum() == flat.fixed.sum() + 11
    assert surface.topology.seam_edge.any()
    assert add_walls(surface, {}) is surface


def test_four_quarters_of_two_patches_get_a_wall_for_each_border():
    X, F = grid(8, bump)
    surface = surface_from_labels(X, F, [3, 5, 5, 3] @ np.eye(4)[quarters(X, F)].T, tension=2.0, walls=1.0)
    assert [p.name for p in surface.patches[2:]] == [f"wall-3.0-5.0-{k}" for k in (1, 2, 3, 4)]
    (line,) = line_of(surface)
    assert line.sheets == (2, 3, 4, 5)


def test_a_border_that_is_a_ring():
    X, F = grid(12, bump)
    inner = (np.abs(X[F].mean(axis=1)[:, :2]) < 0.5).all(axis=1)
    surface = surface_from_labels(
        X, F, np.where(inner, "in", "out"), tension=2.0, walls=1.0, bottom="sliding"
    )
    assert [p.name for p in surface.patches] == ["out", "in", "wall-out-in"]
    assert minimum_angle(surface) > 20.0
    assert surface.on_plane.sum() == 24


def test_walls_on_a_tilted_plane():
    X, F = grid(8, bump)
    labels = X[F].mean(axis=1)[:, 0] > 0
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    plane = Plane((3, 1, 2), turn[:, 2])
    one = surface_from_labels(X, F, labels, tension=2.0, walls=1.0)
    two = surface_from_labels(X @ turn.T + [3, 1, 2], F, labels, tension=2.0, walls=1.0, plane=plane)
    np.testing.assert_allclose(two.vertices, one.vertices @ turn.T + [3, 1, 2], atol=1e-12)
    np.testing.assert_array_equal(two.on_plane, one.on_plane)


@pytest.mark.parametrize("bottom", ["sliding", "held"])
def test_no_room_for_a_wall(bottom):
    X, F = grid(6)
    labels = X[F].mean(axis=1)[:, 0] > 0
    with refused(SurfaceError, what="vertices", found=0.0):
        surface_from_labels(X, F, labels, tension=2.0, walls=1.0, bottom=bottom)


def test_unknown_borders_and_bottoms():
    flat = bare([[4, 0], [4, 6]])
    with refused(OptionError, what="tension", where=("patch 1", "patch 3")):
        add_walls(flat, {("patch 1", "patch 3"): 1.0})
    with pytest.raises(OptionError, match="unknown bottom 'slidin'; did you mean 'sliding'"):
        add_walls(flat, bottom="slidin")


def test_labels_become_patches_in_the_order_they_come():
    X, F = grid(4, bump)
    surface = surface_from_labels(
        X,
        F,
        np.array(["d", "c", "b", "a"])[quarters(X, F)],
        tension={"a": 1.0, "b": 2.0, "c": 3.0, "d": 4.0},
        pressure=0.5,
    )
    assert [(p.name, p.tension) for p in surface.patches] == [("d", 4), ("c", 3), ("b", 2), ("a", 1)]
    assert {p.pressure for p in surface.patches} == {0.5}
    assert surface.fixed.sum() == 16
    free = surface_from_labels(X, F, tension=1.0, boundary="sliding")
    assert free.patches[0].name == "surface"
    assert free.on_plane.sum() == 16
    with pytest.warns(UserWarning, match="no vertex is fixed"):
        assert surface_from_labels(X, F, tension=1.0, boundary="free").free.all()


def test_faces_are_turned_outwards_patch_by_patch():
    X, F = grid(6, bump)
    labels = quarters(X, F)
    expected = surface_from_labels(X, F, labels, tension=1.0)
    flip = np.random.default_rng(1).random(len(F)) < 0.5
    mixed = np.where(flip[:, None], F[:, ::-1], F)
    found = surface_from_labels(X, mixed, labels, tension=1.0)
    assert (np.sort(found.faces, axis=1) == np.sort(expected.faces, axis=1)).all()
    corner = found.vertices[found.faces]
    up = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, 2]
    assert (up > 0).all()


def test_a_closed_mesh_faces_away_from_its_middle():
    X = np.concatenate([np.eye(3), -np.eye(3)]) + np.array([5, 0, 0])
    F = [[0, 1, 2], [1, 3, 2], [4, 3, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [3, 4, 5], [0, 4, 5]]
    with pytest.warns(UserWarning, match="no vertex is fixed"):
        surface = surface_from_labels(X, F, [0, 0, 0, 0, 1, 1, 1, 1], tension=1.0)
    corner = surface.vertices[surface.faces] - [5, 0, 0]
    assert (np.linalg.det(corner) > 0).all()


def test_welding_and_unused_vertices():
    X, F = grid(4, bump)
    soup = np.concatenate([X[F].reshape(-1, 3), [[9, 9, 9]]])
    loose = np.arange(3 * len(F)).reshape(-1, 3)
    surface = surface_from_labels(soup, loose, tension=1.0, weld=1e-9)
    assert surface.n == len(X)
    assert surface.fixed.sum() == 16
    with refused(SurfaceError, what="faces", where=0):
        surface_from_labels(soup, loose, tension=1.0, weld=0.6)
    with pytest.raises(OptionError, match="weld: expected a finite number ≥ 0, found -1"):
        surface_from_labels(soup, loose, tension=1.0, weld=-1.0)


def test_an_unknown_support_of_the_boundary():
    with pytest.raises(OptionError, match="unknown boundary 'fixd'; did you mean 'fixed'"):
        surface_from_labels(*grid(2, bump), tension=1.0, boundary="fixd")


def test_a_moebius_strip_is_refused():
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    width = np.array([-0.3, 0.3])[None, :, None]
    middle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)[:, None]
    radial = np.cos(angle / 2)[:, None] * middle[:, 0]
    radial[:, 2] = np.sin(angle / 2)
    X = (middle + width * radial[:, None]).reshape(-1, 3)
    k = np.arange(12)
    a, b = 2 * k, 2 * k + 1
    c, d = np.where(k < 11, 2 * k + 2, 1), np.where(k < 11, 2 * k + 3, 0)
    F = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    with refused(SurfaceError, what="faces", where=0):
        surface_from_labels(X, F, tension=1.0)


@pytest.mark.parametrize(
    ("arguments", "error", "fields"),
    [
        ({"labels": [0, 1]}, SurfaceError, {"what": "labels", "found": (2,), "expected": (8,)}),
        ({"tension": {"surfac": 1.0}}, OptionError, {"what": "tension", "found": "surfac"}),
        ({"pressure": {}}, OptionError, {"what": "pressure", "where": "surface"}),
    ],
)
def test_wrong_labels_are_refused(arguments, error, fields):
    with refused(error, **fields):
        surface_from_labels(*grid(2, bump), **{"tension": 1.0, **arguments})


def sail_hall() -> Surface:
    """A hall of a patch under pressure and a sail without, with a wall under their border."""
    patches = {"west": {"tension": 4.0}, "sail": {"tension": 4.0, "pressure": 0.0}}
    return Plan(BOX, [Divider([[4, 0], [4, 6]])], edge_length=1.0, patches=patches).surface()


def test_a_sail_is_roof_and_what_hangs_below_a_junction_is_a_wall():
    def walls(surface):
        return [p.name for p, wall in zip(surface.patches, surface.walls, strict=True) if wall]

    hall, squares = sail_hall(), two_squares(4)
    assert walls(hall) == ["wall 1"]
    assert walls(hall.retensioned(pressures={"west": 0.0})) == ["wall 1"]  # declared by the plan
    assert walls(hall.retensioned(walls=["sail"])) == ["sail", "wall 1"]
    assert walls(hypar_roof(4, weight=0.1)) == []
    assert walls(lens(0.4)) == []  # a film around a cushion hangs below nothing
    assert walls(squares) == ["wall"]
    assert not squares.patches[2].wall
    flat = squares.vertices * [1.0, 1.0, 0.0]
    below = squares.vertices * [1.0, 1.0, -1.0]
    assert walls(squares.moved(flat)) == walls(squares.moved(below)) == ["wall"]  # pinched; under suction
    heavy = squares.retensioned(pressures={"left": 0.0, "right": 0.0}, weights={"left": -1.0, "right": -1.0})
    assert walls(heavy) == ["wall"]
    assert walls(squares.retensioned(pressures={"left": 0.0, "right": 0.0})) == []  # three films


def test_a_sail_that_is_inflated_stays_a_roof_and_its_wall_follows():
    hall = sail_hall()
    line = Direction(pressures={"sail": 1.0}, relative=True).line(hall)
    half = line.surface_at(hall, 0.5)
    assert half.pressures.tolist() == pytest.approx([1.0, 0.5, 0.5])
    assert [patch.wall for patch in half.patches] == [False, False, True]


def test_files_tables_and_pictures_show_a_sail_as_roof(tmp_path):
    hall, certificate = sail_hall(), pcmc.certify(sail_hall())
    pcmc.write(tmp_path / "hall.ifc", hall)
    text = (tmp_path / "hall.ifc").read_text()
    assert (text.count("IFCSLAB("), text.count("IFCWALL(")) == (2, 1)
    np.testing.assert_array_equal(patch_colors(hall)[:2], [rgb(color) for color in SHEETS[:2]])
    rows = table_of_patches(hall, certificate, Units("m")).rows
    assert [row[1] for row in rows] == ["roof", "roof", "wall"]
    assert [patch["wall"] for patch in outline(hall, np.zeros(3))[0]["patches"]] == [False, False, True]
    assert [group["wall"] for group in _controls(hall)] == [False, False, True]
    assert pcmc.panels(hall, 0.1, anyway=True).area == pytest.approx(patch_areas(hall)[:2].sum())
    drawn = [c.vertices for c in drawing_set(hall, "m", anyway=True).curves if c.layer == "PCMC-WALL"]
    assert set(np.concatenate(drawn)) <= set(hall.faces[hall.patch_of_face == 2].ravel())
    assert repr(hall).splitlines()[2].startswith("  walls: wall 1 ")


def test_a_wall_up_to_the_axis_of_two_mirror_planes_stands_as_that_of_a_plan():
    corners, mirrors = [[0, 0, 1], [6, 0, 1], [6, 6, 1], [0, 6, 1]], [[[6, 0], [6, 6]], [[0, 6], [6, 6]]]
    patches = {"a": {"tension": 6.0}, "b": {"tension": 6.0}}
    quarters = [
        Plan(corners, [Divider([[0, 0], [6, 6]], wall=wall)], patches=patches, mirrors=mirrors).surface()
        for wall in (1.5, None)
    ]
    one, other = (pcmc.energy(pcmc.solve(s).surface) for s in (quarters[0], add_walls(quarters[1], 1.5)))
    assert one == pytest.approx(other, rel=1e-6)
