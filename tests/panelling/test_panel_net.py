"""Nets of quads and hexagons: planar along lines of curvature, closed forms, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from nightly import at_night

import pcmc
from generators import delaunay, spherical_cap, two_squares
from pcmc.base.errors import FileError, OptionError, SurfaceError
from pcmc.panelling import panel_net
from pcmc.panelling.net import CORNER, EDGE, Net, tidied
from pcmc.panelling.planar import by_corners
from pcmc.panelling.sheet import shape_operators
from pcmc.plan import Plan


def _curvatures(surface, waviness=0.4):
    """κ₁ - κ₂ of Delaunay's surface at its vertices: κ = z'/r around and 1 - κ along it."""
    square = (surface.vertices[:, :2] ** 2).sum(axis=1)
    around = 0.5 * (1.0 + square - waviness**2) / square
    return np.abs(2.0 * around - 1.0)


def test_principal_curvatures_of_an_unduloid_converge_with_order_two():
    error = []
    for edge in (0.3, 0.15, 0.075):
        surface = delaunay(edge, exact=True)
        T = shape_operators(surface.vertices, surface.faces)
        trace = np.trace(T, axis1=1, axis2=2)
        apart = np.sqrt(np.maximum(2.0 * (T**2).sum(axis=(1, 2)) - trace**2, 0.0))
        error.append(np.abs(apart - _curvatures(surface)).max())
    assert (np.log2(np.divide(error[:-1], error[1:])) > 1.9).all()


@pytest.mark.parametrize(
    "shape", [{}, *at_night({"waviness": 1.6, "centre": "bulge"}, {"waviness": 0.0}), {"centre": "neck"}]
)
def test_panels_of_delaunays_surfaces_lie_between_meridians_and_parallels(shape):
    surface = delaunay(0.15, exact=True, **shape)
    net = panel_net(surface, 0.4, anyway=True)
    assert set(net.panels["kind"]) == {"whole"}
    assert net.panels["planarity"].max() < 1e-6
    assert len(net.umbilics) == 0
    count = int((net.beams["neighbour"] == 0).sum()) // 2  # meridians
    rows = len(net.points) // count
    assert len(net.points) == count * rows
    assert len(net.panels) == count * (rows - 1)
    heights = np.sort(net.points[:, 2]).reshape(rows, count)
    assert np.ptp(heights, axis=1).max() < 0.01  # of parallels
    assert net.beams["torsion_normal"].max() < 0.1


def test_traces_of_a_net_close_and_beams_count_as_euler_says():
    net = panel_net(delaunay(0.15, exact=True), 0.4, anyway=True)
    assert len(net.points) - len(net.beams) + len(net.panels) == 0  # an annulus
    assert (net.beams["neighbour"] == 0).sum() == 2 * 17
    assert np.bincount(net.corner).max() == 4


@pytest.fixture(scope="module")
def rectangle():
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], edge_length=0.8, patches={"roof": {"tension": 5.0}})
    return pcmc.solve(plan.surface()).surface


def test_a_roof_over_a_rectangle_has_two_umbilics_on_its_axis_with_six_sided_panels(rectangle):
    net = panel_net(rectangle, 1.0)
    assert np.abs(net.umbilics[:, 1] - 4.0).max() < 0.8
    assert abs(net.umbilics[:, 0].sum() - 12.0) < 0.8
    around = net.panels.query("kind == 'umbilic'")
    assert around["corners"].tolist() == [6, 6]
    inside = net.panels.query("kind != 'cut'")
    assert inside["planarity"].max() < 1e-5
    assert net.panels["planarity"].max() < 0.03
    assert net.nodes["distance"].max() < 0.15
    assert len(net.points) - len(net.beams) + len(net.panels) == 1


def test_panels_called_umbilic_are_those_around_the_umbilics():
    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], edge_length=1.3, tension=5.0)
    net = panel_net(pcmc.solve(plan.surface()).surface, 1.5)
    around = np.flatnonzero(net.panels["kind"] == "umbilic")
    middles = [net.points[net.corner[net.start[k] : net.start[k + 1]]].mean(axis=0) for k in around]
    away = np.linalg.norm(np.array(middles)[:, None] - net.umbilics, axis=2)
    assert away.shape == (2, 2)
    assert (away.min(axis=0) < 0.75).all()


@pytest.fixture(scope="module")
def walled():
    from pcmc.plan import Divider

    plan = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], [Divider([[6, 0], [6, 8]], wall=1.5)], edge_length=0.8,
                patches={"west": {"tension": 5.0}, "east": {"tension": 4.5}})  # fmt: skip
    return pcmc.solve(plan.surface()).surface


def test_panels_share_the_nodes_of_a_ridge(walled):
    net = panel_net(walled, 1.0)
    patch = net.panels["patch"].to_numpy()
    pairs = net.beams.query("neighbour > 0")[["panel", "neighbour"]].to_numpy() - 1
    assert (patch[pairs[:, 0]] != patch[pairs[:, 1]]).sum() >= 4
    assert len(net.points) - len(net.beams) + len(net.panels) == 1


@pytest.mark.parametrize("size", [1.0, 1.3])
def test_triangles_that_planarity_lays_flat_on_a_rim_are_left_out_and_the_rim_stays_closed(rectangle, size):
    net = panel_net(rectangle, size)
    assert net.panels["area"].min() > 0.01 * size**2
    assert 0.99 < net.covered < 1.0
    rim = net.beams.query("neighbour == 0")
    assert rim["length"].sum() == pytest.approx(40.0, rel=1e-9)
    on_rim = np.unique(rim[["node", "other"]]) - 1
    assert "inside" not in set(net.nodes["kind"][on_rim])
    assert np.ptp(net.points[on_rim, 2]) < 1e-9
    assert len(net.points) - len(net.beams) + len(net.panels) == 1


def test_no_corner_of_a_roof_is_cut_off():
    outline = [[0, 0], [12, 0], [12, 6], [6, 6], [6, 10], [0, 10]]
    roof = pcmc.solve(Plan(outline, edge_length=0.4, tension=5.0).surface()).surface
    for size in (0.7, 0.8, 1.1):
        nodes = panel_net(roof, size).nodes
        corners = nodes.loc[nodes["kind"] == "corner", ["x", "y"]].to_numpy().round(9).tolist()
        assert sorted(corners) == sorted(outline)


def test_a_small_panel_with_an_acute_corner_is_no_sliver():
    c, s = np.cos(np.radians(30.0)), np.sin(np.radians(30.0))
    points = np.array([[0, 0, 0], [0.195, 0, 0], [0.195 * c, 0.195 * s, 0], [1, 0, 0], [c, s, 0]])
    kind = np.array([CORNER, EDGE, EDGE, CORNER, CORNER])
    corners, start = np.array([0, 1, 2, 1, 3, 4, 2]), np.array([0, 3, 7])
    rest = np.zeros(2, dtype=int), np.ones(2, dtype=bool), np.zeros(2)
    left = tidied(Net(points, np.tile([0.0, 0, 1], (5, 1)), kind, start, corners, *rest), 1.0)
    assert np.array_equal(left.points, points)
    assert left.start.tolist() == [0, 3, 7]


@pytest.mark.parametrize(("depth", "start"), [(0.03, [0, 4, 7]), (0.06, [0, 3, 7, 10])])
def test_a_panel_on_the_rim_below_a_hundredth_of_the_square_of_the_size_is_left_out(depth, start):
    """A triangle of that depth on a side of 0.4, beside a quad and another triangle; the size is 2."""
    xy = [[0, 0], [0.2, -depth], [0.4, 0], [0.4, 0.5], [0, 0.5], [0, -0.5], [0.4, -0.5]]
    points, kind = 2.0 * np.pad(np.array(xy), ((0, 0), (0, 1))), np.full(7, CORNER)
    corners, every = np.array([0, 1, 2, 0, 2, 3, 4, 1, 5, 6]), np.array([0, 3, 7, 10])
    rest = np.zeros(3, dtype=int), np.ones(3, dtype=bool), np.zeros(3)
    left = tidied(Net(points, np.tile([0.0, 0, 1], (7, 1)), kind, every, corners, *rest), 2.0)
    assert np.array_equal(left.points, points)
    assert left.start.tolist() == start


def test_the_share_of_the_roof_that_panels_cover_grows_as_they_get_smaller(walled):
    left = [1.0 - panel_net(walled, size, "quads").covered for size in (1.6, 0.8)]
    assert 0.0 < 2.0 * left[1] < left[0] < 0.01
    assert f"{100.0 * (1.0 - left[1]):.2f} % of the roof's" in str(panel_net(walled, 0.8, "quads"))


def test_a_net_that_leaves_the_roof_says_so(rectangle):
    net = panel_net(rectangle, 3.5)
    share = 100.0 * net.nodes["distance"].max() / 3.5
    assert f"far off  nodes are up to {share:.0f} % of the size from the surface" in str(net)
    assert "far off" not in str(panel_net(rectangle, 0.9))


def test_a_wide_panel_over_an_umbilic_is_named():
    far = [3.0, 27.0**0.5]
    mirrors = [[[0, 0], [6, 0]], [[0, 0], far]]
    sixth = Plan([[0, 0], [6, 0], far], mirrors=mirrors, edge_length=0.4, tension=4.0).surface()
    net = panel_net(pcmc.mirrored(pcmc.solve(sixth).surface), 0.9)
    widest = net.panels.loc[net.panels["distance"].idxmax()]
    assert widest["kind"] == "umbilic"
    assert widest["area"] > 20.0 * 0.9**2
    share = 100.0 * widest["distance"] / 0.9
    assert (
        f"panel {widest['panel']} (umbilic), with an area of {widest['area']:.3g}, is {share:.0f} %"
        in str(net)
    )


def test_panels_without_area_are_told_of(rectangle):
    net = panel_net(rectangle, 1.0, "quads")
    thin = net.panels.assign(area=net.panels["area"].where(net.panels["panel"] != 7, 1e-4))
    assert "slivers  1 panels have next to no area, as panel 7" in str(replace(net, panels=thin))
    assert "slivers" not in str(net)


def test_tables_of_a_net_number_its_nodes_beams_and_panels_from_1(rectangle):
    """A beam is as long as its nodes are apart, and every panel has as many beams as corners."""
    net = panel_net(rectangle, 1.0)
    for table, name in ((net.nodes, "node"), (net.beams, "beam"), (net.panels, "panel")):
        assert table[name].tolist() == list(range(1, len(table) + 1))
    P = net.nodes.set_index("node")[[*"xyz"]]
    apart = P.loc[net.beams["node"]].to_numpy() - P.loc[net.beams["other"]].to_numpy()
    assert net.beams["length"].to_numpy() == pytest.approx(np.linalg.norm(apart, axis=1))
    beside = net.beams[["panel", "neighbour"]].to_numpy()
    assert (beside[:, 0] != beside[:, 1]).all()
    assert np.bincount(beside.ravel())[1:].tolist() == net.panels["corners"].tolist()
    rim = net.beams[net.beams["neighbour"] == 0][["node", "other"]].to_numpy().ravel()
    assert set(net.nodes["kind"][rim - 1]) == {"edge", "corner"}


def test_quads_of_a_grid_stay_on_the_surface_and_are_worse_planar(rectangle):
    grid, planar = panel_net(rectangle, 1.0, "quads"), panel_net(rectangle, 1.0)
    assert grid.nodes["distance"].max() < 1e-12
    assert grid.panels["planarity"].median() > 100 * planar.panels["planarity"].median()
    assert grid.beams["torsion_normal"].median() > 2 * planar.beams["torsion_normal"].median()
    assert abs(grid.panels["area"].sum() / sum(pcmc.certify(rectangle).patches["area"]) - 1.0) < 0.02


def test_warped_panels_are_told_with_what_to_build():
    """Around the corner of a raised hole quads with a corner cut out are warped by a fifth."""
    raised = [[4, 4, 2], [6, 4, 2], [6, 6, 2], [4, 6, 2]]
    square = [[0, 0], [10, 0], [10, 10], [0, 10]]
    plan = Plan(square, holes=[raised], edge_length=0.8, tension=8.0, pressure=0.2)
    roof = pcmc.solve(plan.surface()).surface
    [line] = [line for line in str(panel_net(roof, 0.8, pattern="quads")).splitlines() if "warped" in line]
    assert "build these of triangles" in line
    assert "warped" not in str(panel_net(roof, 0.8, pattern="planar-quads"))


@pytest.mark.parametrize("pattern", ["quads", "hexagons"])
def test_a_grid_in_plan_is_one_on_a_tilted_plane(rectangle, pattern):
    """Before, it was one along x and y of space: fewer panels, and none on an upright plane."""
    plane = pcmc.Plane(normal=(0.9, 0.1, 0.3))
    own = plane.axes.T  # which turns Π to itself
    X, parts = rectangle.vertices @ own.T, (rectangle.faces, rectangle.patch_of_face, rectangle.patches)
    tilted = pcmc.Surface(X, *parts, fixed=rectangle.fixed, plane=plane)
    nets = [panel_net(surface, 0.5, pattern=pattern, anyway=True) for surface in (rectangle, tilted)]
    assert nets[0].points @ own.T == pytest.approx(nets[1].points, abs=1e-6)


def test_a_grid_in_plan_lies_on_both_sheets_of_a_cushion():
    """The lower sheet's outside is below: seen from there the grid is its mirror image."""
    cushion = Plan([[0, 0], [8, 0], [8, 6], [0, 6]], cushion=1.0, edge_length=1.0, tension=12.0).surface()
    found = panel_net(pcmc.solve(cushion).surface, 2.1, "quads")
    above, below = (found.panels["patch"] == f"patch 1{name}" for name in ("", " below"))
    np.testing.assert_allclose(*(sorted(found.panels["area"][side]) for side in (above, below)), rtol=1e-9)
    inner = found.nodes["kind"] == "inside"
    assert (found.normals[inner, 2] * found.points[inner, 2] > 0.0).all()


def test_hexagons_have_three_edges_at_each_node_inside_and_are_planar(rectangle):
    net = panel_net(rectangle, 1.0, "hexagons")
    ends = net.beams[["node", "other"]].to_numpy().ravel() - 1
    inside = net.nodes["kind"].to_numpy() == "inside"
    assert set(np.bincount(ends)[inside]) == {3}
    whole = net.panels.query("kind == 'whole'")
    assert set(whole["corners"]) == {6}
    assert whole["planarity"].max() < 1e-4


def test_a_parallel_net_has_parallel_edges_and_one_along_the_normals_has_not(rectangle):
    net = panel_net(rectangle, 1.0)
    ends = net.beams[["node", "other"]].to_numpy() - 1
    for torsion, most in ((False, 0.2), (True, 20.0)):
        shifted = net.offset(0.2, torsion=torsion)
        one, other = (P[ends[:, 1]] - P[ends[:, 0]] for P in (net.points, shifted))
        sine = np.linalg.norm(np.cross(one, other), axis=1)
        sine /= np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
        assert np.degrees(np.arcsin(sine)).max() < most
    assert net.beams["torsion"].max() < 0.2 < net.beams["torsion_normal"].max()


def test_planarity_is_that_of_libigl_and_compas(rectangle):
    import igl
    from compas.geometry import distance_line_line

    net = panel_net(rectangle, 1.0, "quads")
    for chosen, loops in by_corners(net.start, net.corner):
        if loops.shape[1] == 4:
            for k, loop in zip(chosen[:20], loops[:20], strict=True):
                a, b, c, d = net.points[loop].tolist()
                gap = distance_line_line((a, c), (b, d))
                lengths = np.linalg.norm(np.subtract(a, c)) + np.linalg.norm(np.subtract(b, d))
                assert net.panels["planarity"][k] == pytest.approx(2.0 * gap / lengths, abs=1e-12)
            found = igl.quad_planarity(net.points, loops.astype(np.int64))
            assert np.allclose(np.abs(np.ravel(found)), net.panels["planarity"][chosen], atol=1e-9)


def test_bad_input_is_refused_in_one_line(rectangle):
    cap = pcmc.solve(spherical_cap(0.2)).surface
    with pytest.raises(OptionError, match="part of a sphere: every point is an umbilic"):
        panel_net(cap, 0.2)
    with pytest.raises(OptionError, match="too large for patch 'roof'; choose at most 6"):
        panel_net(rectangle, 7.0)
    with pytest.raises(OptionError, match="more than 100000 on patch 'roof'; choose at least"):
        panel_net(rectangle, 1e-3, "quads")
    with pytest.raises(OptionError, match="planar-quads follow lines of curvature"):
        panel_net(rectangle, 1.0, direction=30.0)
    with pytest.raises(OptionError, match="is upright or overhangs at"):
        panel_net(delaunay(exact=True), 0.4, "quads", anyway=True)
    with pytest.raises(OptionError, match="pattern"):
        panel_net(rectangle, 1.0, "octagons")
    with pytest.raises(OptionError, match="size"):
        panel_net(rectangle, -1.0)
    with pytest.raises(OptionError, match="direction"):
        panel_net(rectangle, 1.0, "quads", direction=np.nan)
    flat = replace(rectangle, vertices=rectangle.vertices * [1.0, 1.0, 0.0])
    with pytest.raises(OptionError, match="patch 'roof' is flat: every point is an umbilic"):
        panel_net(flat, 1.0, anyway=True)
    with pytest.raises(SurfaceError, match="not converged"):
        panel_net(flat, 1.0)
    wall = [replace(patch, pressure=0.0, wall=True) for patch in rectangle.patches]
    with pytest.raises(SurfaceError, match="no panels: every patch is a wall"):
        panel_net(replace(rectangle, patches=tuple(wall)), 1.0, anyway=True)


@pytest.mark.parametrize("pattern", ["quads", "hexagons"])
@pytest.mark.parametrize("direction", [0.0, 45.0, 60.0])
def test_lines_along_edges_and_through_vertices_of_the_mesh_leave_no_gap(pattern, direction):
    net = panel_net(two_squares(8), 0.5, pattern, direction=direction, anyway=True)
    assert len(net.points) - len(net.beams) + len(net.panels) == 1
    assert net.beams.query("neighbour == 0")["length"].sum() == pytest.approx(24.0, rel=1e-6)


def test_a_panel_with_a_hole_is_refused():
    hole = {"name": "hole", "curve": {"circle": {"centre": [4.5, 2.5], "radius": 0.5}}}
    roof = Plan([[0, 0], [12, 0], [12, 8], [0, 8]], holes=[hole], edge_length=0.8, tension=5.0).surface()
    with pytest.raises(
        OptionError, match="no net of panels of 3 fits patch 'patch 1'; choose a smaller size"
    ):
        panel_net(roof, 3.0, "quads", anyway=True)
    net = panel_net(roof, 1.0, "quads", anyway=True)
    assert len(net.points) - len(net.beams) + len(net.panels) == 0


def test_an_obj_file_has_the_points_and_panels_in_their_groups(rectangle, tmp_path):
    net = panel_net(rectangle, 2.0, "quads")
    net.write_obj(tmp_path / "net.obj")
    words = [line.split() for line in (tmp_path / "net.obj").read_text(encoding="utf-8").splitlines()]
    points = np.array([line[1:] for line in words if line[0] == "v"], dtype=float)
    panels = [np.array(line[1:], dtype=int) for line in words if line[0] == "f"]
    groups = [line[1] for line in words if line[0] == "g"]
    assert np.array_equal(points, net.points)
    assert [panel.tolist() for panel in panels] == [(loop + 1).tolist() for loop in net.polygons]
    assert groups == list(dict.fromkeys(net.panels["patch"]))
    with pytest.raises(FileError, match=r"nowhere.*cannot be written"):
        net.write_obj(tmp_path / "nowhere" / "net.obj")
