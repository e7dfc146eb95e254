"""Cutting patterns: closed forms, equal seams, and roofs that are cut."""

from functools import cache

import numpy as np
import pytest
from convergence import orders
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import at_night
from scipy.spatial.transform import Rotation

from generators import joined_caps, spherical_cap
from pcmc import Cable, Patch, Surface, cutting_pattern, solve
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.cloth import CuttingOptions
from pcmc.cloth.sewing import flattened
from pcmc.plan import Divider, Plan

NONE = np.empty((2, 0, 2), dtype=int)


def grid(rows, columns):
    """Triangles of a grid of (rows + 1) (columns + 1) points."""
    number = np.arange((rows + 1) * (columns + 1)).reshape(rows + 1, columns + 1)
    a, b, c, d = (
        part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def on_sphere(longitude, latitude):
    """Points of the unit sphere on a grid of longitudes and latitudes."""
    u, v = np.meshgrid(longitude, latitude, indexing="ij")
    return np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1).reshape(-1, 3)


def laid(X, F):
    return flattened(X, F, np.zeros(len(X), dtype=int), NONE, np.ones((len(X), 2)))


@cache
def cap():
    return solve(spherical_cap()).surface


@cache
def caps():
    return solve(joined_caps()).surface


def test_a_cylinder_is_laid_flat_without_strain():
    angle, z = np.meshgrid(np.linspace(0.0, 2.0, 41), np.linspace(0.0, 1.0, 9), indexing="ij")
    X = np.stack([np.cos(angle), np.sin(angle), z + 0.2 * angle], axis=-1).reshape(-1, 3)
    points, strain = laid(X, grid(40, 8))
    assert (strain == 0.0).all()  # what rounding leaves is none
    chord = 2.0 * np.sin(0.025)
    size = np.hypot(40.0 * chord, 0.0), 1.0  # of the polygonal cylinder, before it is sheared along z
    assert np.ptp(points, axis=0).max() == pytest.approx(np.hypot(size[0], 1.4), rel=1e-3)


def test_the_strain_of_a_strip_on_a_sphere_is_of_order_two_in_its_width():
    """cos r - 1 = -r²/2 less its mean: w²/24 in the middle, -w²/12 at the edges, on the unit sphere."""
    middle, edge = [], []
    for width in (0.4, 0.2, 0.1):
        X, F = on_sphere(np.linspace(0.0, 2.0, 161), np.linspace(-width / 2, width / 2, 17)), grid(160, 16)
        strain = laid(X, F)[1]
        longitude, latitude = np.arctan2(*X[F].mean(axis=1)[:, [1, 0]].T), np.arcsin(X[F].mean(axis=1)[:, 2])
        inner = np.abs(longitude - 1.0) < 0.3  # ends of the strip give way
        middle.append(strain[inner & (np.abs(latitude) < width / 16), 1].mean())
        edge.append(strain[inner & (np.abs(latitude) > width * 7 / 16), 0].mean())
    assert middle == pytest.approx([w * w / 24 for w in (0.4, 0.2, 0.1)], rel=0.03)
    assert edge == pytest.approx([-((15 / 16) ** 2 / 8 - 1 / 24) * w * w for w in (0.4, 0.2, 0.1)], rel=0.05)
    assert (orders(middle) > 1.95).all()
    assert (orders(np.abs(edge)) > 1.95).all()


def test_gores_of_a_sphere_are_the_closed_form():
    """A gore is π/n cos s wide on each side, up to second order in 1/n."""
    errors = []
    for n in (8, 16, 32):
        X = on_sphere(np.linspace(-np.pi / n, np.pi / n, 9), np.linspace(-1.2, 1.2, 97))
        flat = laid(X, grid(8, 96))[0].reshape(9, 97, 2)
        along = flat[4, -1] - flat[4, 0]
        c, s = along / np.linalg.norm(along)
        turned = (flat - flat[4, 48]) @ np.array([[c, -s], [s, c]])
        expected = np.pi / n * np.cos(turned[[0, 8], :, 0])
        errors.append(np.abs(np.abs(turned[[0, 8], :, 1]) - expected).max() / (np.pi / n))
    assert errors[-1] < 2e-3
    assert (orders(errors) > 1.9).all()


@pytest.mark.nightly
def test_a_sphere_is_cut_into_gores_along_drawn_seams():
    """A zone of a sphere, closed around its axis, falls into gores that are alike."""
    n, X = 12, on_sphere(np.arange(48) * 2.0 * np.pi / 48, np.linspace(-1.0, 1.0, 25))
    F = grid(48, 24)
    F %= len(X)
    zone = Surface(X, F, np.zeros(len(F), dtype=int), [Patch("zone", 0.5)], fixed=np.abs(X[:, 2]) > 0.84)
    ends = on_sphere(np.arange(n) * 2.0 * np.pi / n, np.array([-1.0, 1.0])).reshape(n, 2, 3)
    pattern = cutting_pattern(zone, seams=ends.tolist(), anyway=True)
    assert len(pattern.strips) == n
    table = pattern.table
    assert table["width"].to_numpy() == pytest.approx(2 * np.pi / n, abs=2 * np.pi / 48)  # an edge
    assert table["length"].to_numpy() == pytest.approx(2.0, rel=0.03)
    assert table["area"].sum() == pytest.approx(4.0 * np.pi * np.sin(1.0), rel=5e-3)
    assert (pattern.seam_table["kind"] == "seam").sum() == n
    assert pattern.largest_difference < 1e-6
    with pytest.raises(OptionError, match="where it is laid flat: no cloth follows it"):
        cutting_pattern(zone, strips=1, anyway=True)


@pytest.mark.parametrize("width", [*at_night(0.3), 0.5, 3.0])
def test_strips_fit_the_cloth_and_cover_the_roof(width):
    pattern = cutting_pattern(cap(), width=width, allowance=0.02)
    table = pattern.table
    assert table["width"].max() + 0.04 <= width
    assert table["width"].max() + 0.04 > 0.75 * width or width == 3.0
    assert len(table) == {0.3: 10, 0.5: 6, 3.0: 1}[width]
    assert table["area"].sum() == pytest.approx(4.0 * np.pi * 0.6 * 0.5366750419, rel=5e-3)  # of the sphere
    for strip in pattern.strips:
        assert strip.cut_area == pytest.approx(strip.area, rel=float(np.abs(strip.strain).max()))
        assert len(strip.outlines) == 1


def test_the_table_of_seams_has_both_ends_of_each():
    pattern = cutting_pattern(cap(), strips=4)
    ends = pattern.seam_table[["x0", "y0", "z0", "x1", "y1", "z1"]].to_numpy()
    assert ends == pytest.approx(np.array([seam.points[[0, -1]].ravel() for seam in pattern.seams]))


@pytest.mark.nightly
def test_the_strain_of_strips_is_of_order_two_in_their_width():
    strains = [cutting_pattern(cap(), strips=count).table["strain_rms"].max() for count in (4, 8)]
    assert orders(strains) == pytest.approx(2.0, abs=0.3)


def test_sides_of_seams_are_equal_also_between_sheets():
    pattern = cutting_pattern(caps(), width=3.0, compensation=(0.4, 1.5))
    assert pattern.largest_difference < 1e-6
    seams = pattern.seam_table
    assert set(seams["kind"]) == {"seam", "junction", "rim"}
    assert seams.loc[seams["kind"] != "rim", "difference"].max() < 1e-6
    ends = {tuple(np.round(x, 9)) for x in seams.loc[seams["kind"] == "seam", ["x0", "y0", "z0"]].to_numpy()}
    rim = np.array([point for s in pattern.seams if s.kind != "seam" for point in s.points]).round(9)
    assert ends <= set(map(tuple, rim))
    for seam in pattern.seams:
        for side in seam.sides:
            strip = pattern.strips[side.strip - 1]
            assert strip.roof[side.edges[:, 0]] == pytest.approx(seam.points[:-1])
            a, b = (strip.cut[side.edges[:, k]] for k in (0, 1))
            left = np.array([[0.0, -1.0], [1.0, 0.0]])
            inside = 0.5 * (a + b) + (1 if side.forward else -1) * 1e-3 * (b - a) @ left.T
            assert (_winding(strip, inside) == 1).all()


def _winding(strip, points):
    """How often the outline of a strip goes around points."""
    loop = strip.cut[strip.outlines[0]] - points[:, None]
    angle = np.arctan2(loop[..., 1], loop[..., 0])
    steps = np.angle(np.exp(1j * (np.roll(angle, -1, axis=1) - angle)))
    return np.rint(steps.sum(axis=1) / (2.0 * np.pi)).astype(int)


def test_seams_end_where_junctions_meet_if_they_end_near_it():
    """Not beside that point: two sheets would share a seam of a few centimetres there."""
    outline = [(3, 0), (6, 0), (6, 3), (9, 3), (9, 6), (6, 6), (6, 9), (3, 9), (3, 6), (0, 6), (0, 3), (3, 3)]
    lines = [Divider([corner, (4.7, 4.6)], wall=False) for corner in ((3, 3), (6, 3), (6, 6), (3, 6))]
    cross = solve(Plan(outline, lines, edge_length=1.0, tension=1.0, pressure=0.0).surface()).surface
    seams = cutting_pattern(cross, strips=2).seam_table
    assert seams["length"].min() > 1.0
    ends = seams.loc[seams["kind"] == "seam", ["x0", "y0", "x1", "y1"]].to_numpy().reshape(-1, 2)
    assert (np.linalg.norm(ends - (4.7, 4.6), axis=1) < 1e-9).sum() == 4


def test_compensation_shortens_cloth_along_warp_and_weft():
    plain = cutting_pattern(cap(), strips=4, direction=30.0)
    short = cutting_pattern(cap(), strips=4, direction=30.0, compensation=(1.0, 3.0))
    assert short.table["length"].to_numpy() == pytest.approx(0.99 * plain.table["length"], rel=2e-3)
    assert short.table["width"].to_numpy() == pytest.approx(0.97 * plain.table["width"], rel=2e-3)
    alpha = cap().tensions[0]
    stiff = cutting_pattern(cap(), strips=4, stiffness=(50.0 * alpha, 50.0 * alpha), poisson=0.2)
    assert stiff.table[["warp", "weft"]].to_numpy() == pytest.approx(100.0 * (1.0 - 1.0 / 1.016))


@given(angle=st.floats(-180.0, 180.0), shift=st.tuples(*[st.floats(-50.0, 50.0)] * 2))
@settings(max_examples=3, deadline=None)
def test_a_moved_roof_has_the_same_strips(angle, shift):
    turn = Rotation.from_euler("z", angle, degrees=True)
    here = cap()
    there = here.rebuilt(vertices=turn.apply(here.vertices.copy()) + np.array([*shift, 0.0]), curves=())
    before, after = (
        cutting_pattern(surface, strips=3, direction=degrees).table.drop(columns="patch").to_numpy()
        for surface, degrees in ((here, 20.0), (there, 20.0 + angle))
    )
    assert after == pytest.approx(before, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("lines", [[], [[[2, 0], [2, 2], [2, 4]], [[0, 2], [2, 2]], [[2, 2], [4, 2]]]])
def test_a_renumbered_roof_has_the_same_strips(lines):
    """Before, strains differed by 3e-3 %; and of four equal squares some lay along x, and some along y."""
    outline = [[0, 0], [4, 0], [4, 4], [0, 4]] if lines else [[0, 0], [8, 0], [8, 4], [4, 4], [4, 8], [0, 8]]
    flat = Plan(outline, edge_length=1.0 if lines else 2.0, tension=4.0, pressure=0.0).surface()
    bent = flat.vertices + np.outer(0.05 * np.prod(flat.vertices[:, :2], axis=1), [0.0, 0.0, 1.0])
    tables, options = [], {"seams": lines} if lines else {"strips": 3, "direction": 30.0}
    for seed in (0, 5):
        rng = np.random.default_rng(seed)
        number, order = rng.permutation(flat.n), rng.permutation(flat.m)
        X = np.empty_like(bent)
        X[number] = flat.vertices if lines else bent
        F = np.roll(number[flat.faces][order], seed, axis=1)
        same = Surface(X, F, flat.patch_of_face[order], flat.patches, fixed=number[flat.fixed])
        tables.append(cutting_pattern(same, compensation=(1.0, 3.0), anyway=True, **options).table)
    one, other = (table.drop(columns="patch").to_numpy() for table in tables)
    assert one == pytest.approx(other, rel=1e-6, abs=1e-6)
    if lines:
        assert tables[0]["length"].to_numpy() == pytest.approx(0.99 * 2.0, rel=5e-3)
        assert tables[0]["width"].to_numpy() == pytest.approx(0.97 * 2.0)


@given(vector=st.tuples(*[st.floats(-3.0, 3.0)] * 3), shift=st.tuples(*[st.floats(-9.0, 9.0)] * 3))
@settings(max_examples=20, deadline=None)
def test_strain_does_not_change_under_rigid_motions(vector, shift):
    X, F = on_sphere(np.linspace(0.0, 1.0, 9), np.linspace(-0.2, 0.2, 5)), grid(8, 4)
    moved = Rotation.from_rotvec(vector).apply(X) + shift
    assert laid(moved, F)[1] == pytest.approx(laid(X, F)[1], abs=1e-8)


def test_seams_can_be_moved():
    """The ends that the table of seams lists are drawn again, and then elsewhere."""
    pattern = cutting_pattern(cap(), strips=3, direction=0.0)
    ends = pattern.seam_table.query("kind == 'seam'")[["x0", "y0", "z0", "x1", "y1", "z1"]].to_numpy()
    again = cutting_pattern(cap(), seams=ends.reshape(-1, 2, 3).tolist())
    assert sorted(again.table["area"]) == pytest.approx(sorted(pattern.table["area"]), rel=1e-6)
    moved = cutting_pattern(cap(), seams=[[[-0.95, -0.1], [0.95, -0.1]]])  # in the plan; put on the rim
    assert len(moved.strips) == 2
    assert min(moved.table["area"]) < 0.47 * moved.table["area"].sum()


def test_a_slit_that_reaches_no_rim_does_not_open():
    with pytest.raises(OptionError, match="strip 1 of patch 'cap' lies over itself where it is laid flat"):
        cutting_pattern(cap(), seams=[[[-0.5, -0.1], [0.5, -0.1]]])


@pytest.mark.parametrize("turn", [1, -1], ids=["from the seam", "to the seam"])
def test_a_line_may_begin_or_end_at_another(turn):
    """Strips of 4 × 2, 2 × 1 and 2 × 1, whichever way the second line runs."""
    flat = Plan([[0, 0], [6, 0], [6, 2], [0, 2]], edge_length=1.0, tension=2.0, pressure=0.0).surface()
    for sign in (1, -1):
        second = [[3 + sign, 1], [3 + 3 * sign, 1]]
        pattern = cutting_pattern(flat, seams=[[[3 + sign, 0], [3 + sign, 2]], second[::turn]], anyway=True)
        assert sorted(pattern.table["cut_area"]) == pytest.approx([2.0, 2.0, 8.0])


def test_a_line_that_ends_inside_a_sheet_is_a_dart():
    pattern = cutting_pattern(cap(), seams=[[[0.0, -1.0], [0.0, 0.0]]])
    (strip,) = pattern.strips
    (dart,) = [seam for seam in pattern.seams if seam.kind == "seam"]
    assert [side.strip for side in dart.sides] == [1, 1]
    assert len(strip.outlines) == 1
    assert pattern.largest_difference < 1e-6


def test_a_line_across_a_dart_is_refused():
    """It would go around the end of the dart; beside the dart it may end."""
    dart = [[0.0, -1.0], [0.0, 0.0]]
    with pytest.raises(OptionError, match=r"seam 2: between its points it meets .* at \(0, 0, 0\.5"):
        cutting_pattern(cap(), seams=[dart, [[-0.9, -0.5], [0.9, -0.5]]])
    assert len(cutting_pattern(cap(), seams=[dart, [[-0.95, 0.3], [0.95, 0.3]]]).strips) == 2


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ([[1, 4], [4, 1]], r"from \(1, 4\) to \(4, 1\) it leaves the roof; end it at the rim"),
        ([[2, 3], [3, 2]], r"from \(2, 3\) to \(3, 2\) it leaves the roof"),  # along the rim alone
        ([[2, 3, 0], [3, 2, 0]], "it leaves the roof"),
        ([[0, 3], [4, 1.6]], r"between its points it meets a rim, .* at \(2, 2\)"),
    ],
)
def test_a_line_across_a_notch_is_refused(line, message):
    """It would go around the corner, along the rim, and leave three strips; two lines may end there."""
    outline = [[0, 0], [4, 0], [4, 2], [2, 2], [2, 4], [0, 4]]
    notched = Plan(outline, edge_length=1.0, tension=2.0, pressure=0.0).surface()
    with pytest.raises(OptionError, match=message):
        cutting_pattern(notched, seams=[line], anyway=True)
    both = [[[0, 3], [2, 2]], [[2, 2], [4, 1.6]], [[2, 2], [2, 4]]]  # the last along the rim
    assert len(cutting_pattern(notched, seams=both, anyway=True).strips) == 3


def test_sheets_close_over_each_other_are_cut_apart_and_a_square_one_along_x():
    X = np.array([[x, y, z] for z in (0.0, 0.01) for y in (0.0, 1.0, 2.0) for x in (0.0, 1.0, 2.0)])
    F = np.concatenate([grid(2, 2)[:, ::-1], grid(2, 2)[:, ::-1] + 9])
    patches = [Patch("lower", 1.0, 0.0), Patch("upper", 1.0, 0.0)]
    two = Surface(X, F, np.repeat([0, 1], 8), patches, fixed=range(18))
    pattern = cutting_pattern(two, strips=2, anyway=True)
    assert pattern.table["patch"].tolist() == ["lower", "lower", "upper", "upper"]
    assert pattern.table["cut_area"].to_numpy() == pytest.approx(2.0)
    for strip in pattern.strips:
        assert np.ptp(strip.roof, axis=0) == pytest.approx([2.0, 1.0, 0.0])


def test_cables_and_holes_are_cut_around():
    lines = {"holes": [{"curve": [[3.0, 1.5], [5.0, 1.5], [5.0, 2.5], [3.0, 2.5]]}]}
    hall = Plan([[0, 0], [8, 0], [8, 4], [0, 4]], edge_length=0.5, tension=8.0, **lines).surface()
    pattern = cutting_pattern(solve(hall).surface, width=1.2, anyway=True)
    assert pattern.table["width"].max() <= 1.2
    assert pattern.table["area"].sum() == pytest.approx(sum(pattern.certificate.patches["area"]), rel=1e-4)
    seams = pattern.seam_table.query("kind == 'seam'")
    assert len(pattern.strips) == 4
    assert seams["strips"].tolist() == ["1 | 2", "2 | 3", "2 | 3", "3 | 4"]  # the middle one ends at the hole


def test_both_sheets_of_a_cushion_are_cut():
    """Each sheet has its own seams, though both end at the rim that they share; drawn in the plan, a seam is
    on the upper one."""
    cushion = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], edge_length=0.5, tension=1.5, cushion=1.5).surface()
    cushion = solve(cushion).surface
    pattern = cutting_pattern(cushion, strips=2)
    assert pattern.table["patch"].tolist() == ["patch 1"] * 2 + ["patch 1 below"] * 2
    assert pattern.table["area"].sum() == pytest.approx(sum(pattern.certificate.patches["area"]), rel=0.01)
    middles = [seam.points[len(seam.points) // 2, 2] for seam in pattern.seams if seam.kind == "seam"]
    assert np.sign(middles).tolist() == [1.0, -1.0]
    drawn = cutting_pattern(cushion, seams=[[[0.0, 1.0], [4.0, 1.0]]], anyway=True)
    (seam,) = [seam for seam in drawn.seams if seam.kind == "seam"]
    assert seam.points[:, 2].max() > 0.2
    assert drawn.table["patch"].tolist() == ["patch 1", "patch 1", "patch 1 below"]


def test_a_cable_is_a_seam():
    corners = np.array([[0, 0, 0], [4, 0, 0], [8, 0, 0], [8, 4, 0], [4, 4, 0], [0, 4, 0.0]])
    faces = [[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4]]
    flat = Surface(
        corners, faces, [0] * 4, [Patch("sail", 2.0)], fixed=range(6), cables=[Cable("c", 1.0, [[1, 4]])]
    )
    pattern = cutting_pattern(flat, width=9.0, anyway=True)
    assert pattern.table["area"].tolist() == [16.0, 16.0]
    assert pattern.seam_table["kind"].tolist().count("junction") == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "needs the width of the cloth, a number of strips, or seams; give --width"),
        ({"width": 0.0}, "width: expected"),
        ({"width": 1.0, "strips": 2}, "strips: the width gives their number; leave out one of both"),
        ({"strips": 0}, "strips: expected"),
        ({"width": 1e-300}, "at most 1000 are made"),
        ({"width": 0.1, "allowance": 0.05}, "width: 0.1 leaves no cloth between two allowances of 0.05"),
        (
            {"seams": [[[0.0, 0.0], [9.0, 0.0]]]},
            r"its point \(9, 0\) is off the roof, 8 from it; move it",
        ),
        ({"seams": [[[0.0, 0.0]]]}, "two or more points"),
        ({"seams": [["a", "b"]]}, "two or more points"),
        (
            {"seams": [[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]]},
            r"seam 2: from .* it crosses another seam, a ridge or a cable"
            r" near \(-?0(\.0\d*)?, -?0(\.0\d*)?, 0\.5\d*\);",
        ),
        (
            {"seams": [[[-1.0, 0.0], [1.0, 0.0]]], "width": 0.5},
            "a strip of 'cap' around .* is 1.* wide",
        ),
        ({"strips": 2, "compensation": (1.0,)}, "compensation: expected two numbers"),
        ({"strips": 2, "compensation": (1.0, 50.0)}, "compensation: expected"),
        ({"strips": 2, "compensation": (1.0, 1.0), "stiffness": (1.0, 1.0)}, "leave out one of both"),
        ({"strips": 2, "compensation": (1.0, 1.0), "poisson": 0.2}, "poisson: it counts with the stiffness"),
        (
            {"strips": 2, "stiffness": (50.0, 200.0), "poisson": 0.5},
            r"less than warp/poisson² = 200, found 200",
        ),
        ({"strips": {"dome": 2}}, "dome"),
    ],
)
def test_bad_input_is_refused_in_one_line(options, message):
    with pytest.raises(OptionError, match=message) as refused:
        cutting_pattern(cap(), **options)
    assert "\n" not in str(refused.value)


def test_uncertified_and_closed_surfaces_are_refused():
    raised = cap().moved(np.where(cap().fixed[:, None], cap().vertices, cap().vertices * [1.0, 1.0, 1.3]))
    with pytest.raises(SurfaceError, match="not certified"):
        cutting_pattern(raised, width=1.0)
    assert str(cutting_pattern(raised, width=1.0, anyway=True)).lstrip().startswith("not certified  ")
    corners = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
    faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
    closed = Surface(corners, faces, [0] * 4, [Patch("bubble", 1.0)], fixed=range(4))
    with pytest.raises(SurfaceError, match="patch 'bubble' is closed, without a rim"):
        cutting_pattern(closed, width=1.0, anyway=True)


def test_strips_beside_drawn_seams_take_the_direction_of_the_warp():
    seams = [[[-1.0, 0.0], [1.0, 0.0]]]
    along, across = (cutting_pattern(cap(), seams=seams, direction=angle) for angle in (0.0, 90.0))
    for one, other in zip(along.strips, across.strips, strict=True):
        assert one.length == pytest.approx(other.width, rel=0.01)
        assert one.length > 1.5 * one.width


def test_the_stretch_is_what_a_tension_undoes():
    """The cloth pulled back by α (1 - ν) / S in the warp is as long as on the roof."""
    warp, weft = CuttingOptions(strips=1, stiffness=(200.0, 100.0), poisson=0.25).stretch(4.0)
    assert warp * (1.0 + 4.0 * 0.75 / 200.0) == pytest.approx(1.0)
    assert weft * (1.0 + 4.0 / 100.0 - 0.25 * 4.0 / 200.0) == pytest.approx(1.0)
    usual = CuttingOptions(strips=1, stiffness=(200.0, 100.0)).stretch(4.0)[1]
    by_patch = CuttingOptions(strips=1, stiffness=(200.0, 100.0), poisson={"other": 0.2})
    assert usual == by_patch.stretch(4.0, "roof")[1]
    assert usual == CuttingOptions(strips=1, stiffness=(200.0, 100.0), poisson=0.3).stretch(4.0)[1]
    with pytest.raises(OptionError, match=r"compensation of 'a', from its stiffness: .* found 73\.6842"):
        CuttingOptions(strips=1, stiffness=(1.0, 1.0)).stretch(4.0, "a")
    assert CuttingOptions(strips=1, compensation=(20.0, 0.0)).stretch(4.0) == (0.8, 1.0)
    with pytest.raises(OptionError, match="compensation"):
        CuttingOptions(strips=1, compensation=(20.1, 0.0))
