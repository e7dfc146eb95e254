"""Pieces between mirror planes, and the whole that they stand for."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from refusals import refused

import pcmc
from generators import barrel, four_fans, hypar_roof, schwarz_p, spherical_cap, two_squares
from generators.schwarz_p import AREA
from pcmc import Cable, Circle, Line, Patch, Plane, Room, Surface, cli, cut, mirrored
from pcmc.base.errors import FreeSurfaceWarning, OptionError, SurfaceError
from pcmc.certificate.diagnosis import slipping_ends
from pcmc.forces.curvature import mean_curvature
from pcmc.forces.functional import energy_and_gradient, patch_volumes
from pcmc.forces.jacobian import linearise
from pcmc.forces.motion_space import motion_space, vertex_classes
from pcmc.io import load
from pcmc.meshing.refinement import refine
from pcmc.plan import Plan
from pcmc.surface import unfolded
from pcmc.surface.geometry import area_vectors

MIDDLE = Plane(normal=(0, 1, 0), name="middle")
DIAGONALS = Plane(normal=(1, 1, 0), name="one"), Plane(normal=(1, -1, 0), name="other")


def quarter_of_fans(rings=6, **more):
    return cut(cut(four_fans(rings, mesh="double", **more), DIAGONALS[0]), DIAGONALS[1])


PIECES = {
    "half of Example 1": (lambda: two_squares(8, alpha_aux=1.0), [MIDDLE]),
    "half of Example 1, at rest on Π": (lambda: two_squares(8, alpha_aux=3.0), [MIDDLE]),
    "quarter of Example 3": (lambda: four_fans(6, mesh="double"), DIAGONALS),
    "half of a cap": (lambda: spherical_cap(edge_length=0.3), [MIDDLE]),
}


def pieces(case):
    build, planes = PIECES[case]
    whole = piece = build()
    for plane in planes:
        piece = cut(piece, plane)
    return whole, piece


@pytest.mark.parametrize("case", PIECES)
def test_the_whole_is_given_back(case):
    whole, piece = pieces(case)
    again = mirrored(piece)
    assert (again.n, again.m) == (whole.n, whole.m)
    assert pcmc.energy(again) == pytest.approx(pcmc.energy(whole), rel=1e-13)
    assert again.fixed.sum() == whole.fixed.sum()
    assert again.on_plane.sum() == whole.on_plane.sum()
    assert not again.on_planes
    assert not again.on_line


@pytest.mark.parametrize("case", PIECES)
def test_a_piece_at_rest_is_the_whole_at_rest(case):
    """The same shape is at rest, with the same energy, curvatures, lowest symmetric mode and reactions."""
    _, piece = pieces(case)
    result = pcmc.solve(piece, target="stationary")
    assert result.converged
    unfold = unfolded(result.surface)
    whole, own = pcmc.certify(unfold.surface, modes=6), result.certify()
    assert whole.residual < 1e-10
    assert whole.energy == pytest.approx(len(unfold.images) * result.energy, rel=1e-13)
    assert whole.volume == pytest.approx(len(unfold.images) * own.volume, rel=1e-12)
    assert np.abs(whole.eigenvalues - own.eigenvalues[0]).min() < 1e-10 * np.abs(own.eigenvalues[0])
    assert whole.index >= own.index
    for method in ("cotangent", "variational"):
        np.testing.assert_allclose(
            mean_curvature(unfold.surface, method)[np.isfinite(mean_curvature(unfold.surface, method))],
            mean_curvature(result.surface, method)[unfold.vertex][
                np.isfinite(mean_curvature(unfold.surface, method))
            ],
            atol=1e-10,
        )
    held = unfold.surface.fixed
    normal_sum = len(unfold.images) * own.support
    assert whole.support == pytest.approx(normal_sum, rel=1e-10)
    assert held.any()


@pytest.mark.parametrize("case", list(PIECES)[::2])
def test_solved_alone_the_whole_comes_out_the_same(case):
    """From the same start, up to where the iterations leave the mesh along the shape."""
    whole, piece = pieces(case)
    half, full = pcmc.solve(piece, target="stationary"), pcmc.solve(whole, target="stationary")
    again = pcmc.solve(mirrored(half.surface), target="stationary")
    assert again.iterations <= 1
    assert again.energy == pytest.approx(pcmc.energy(mirrored(half.surface)), rel=1e-12)
    assert full.energy == pytest.approx(again.energy, rel=1e-7)


def test_a_junction_does_not_end_where_two_mirror_planes_meet():
    quarter = pcmc.solve(quarter_of_fans()).surface
    ends = [end for mode in pcmc.certify(quarter, modes=3).modes for end in slipping_ends(quarter, mode)]
    assert {tuple(quarter.vertices[end.vertex].round(9).tolist()) for end in ends} == {(20.0, 0.0, 0.0)}


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FreeSurfaceWarning")
def test_half_of_a_heavy_bubble_that_only_its_mirror_holds_falls():
    """As the whole does; of the half nothing was said but that its triangles have collapsed."""
    corners = [[2, 0, 0], [-2, 0, 0], [0, 2, 0], [0, -2, 0], [0, 0, 2], [0, 0, -2]]
    upper = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]]
    faces = upper + [[b, a, 5] for a, b, _ in upper]
    bubble = Surface(corners, faces, [0] * 8, [Patch("bubble", 1.0, 0.5, weight=0.1)])
    half = cut(refine(bubble), Plane(normal=(1, 0, 0)))
    for surface in (half, mirrored(half)):
        [proof] = pcmc.certify(surface).proofs
        assert proof.falls


def test_the_certificate_says_which_motions_it_is_about():
    """The cross of Example 3 is stable among symmetric motions; the whole is the saddle of the paper."""
    own = pcmc.solve(quarter_of_fans())
    assert own.certify().index == 0
    assert own.certify().symmetric_in == ("mirror plane 'one'", "mirror plane 'other'")
    assert "symmetric in mirror plane 'one'" in str(own.certify())
    assert own.certify(whole=True).index == 2
    assert own.certify(whole=True).symmetric_in == ()
    assert own.certify(whole=["one"]).symmetric_in == ("mirror plane 'other'",)


def test_the_image_pulls_across_the_plane():
    """Rows of supports are half of the whole's; the one of the plane balances them and the pressure."""
    result = pcmc.solve(cut(spherical_cap(edge_length=0.3), MIDDLE))
    half, whole = result.certify().boundaries, result.certify(whole=True).boundaries
    assert half["boundary"].tolist()[-1].endswith("in the mirror plane 'middle'")
    up = half["reaction_z"].tolist()
    assert 2 * up[0] == pytest.approx(whole["reaction_z"].sum(), rel=1e-12)
    assert up[-1] == 0.0
    push = area_vectors(result.surface.vertices[result.surface.faces]).sum(axis=0)[1]
    assert half["reaction_y"].sum() == pytest.approx(-push, rel=0.02)
    assert half["per_length_max"].tolist()[0] == pytest.approx(whole["per_length_max"].max(), rel=1e-9)


@pytest.mark.parametrize("case", PIECES)
def test_linearised_forces_at_mirrors(case):
    surface = pieces(case)[1]
    classes, X = vertex_classes(surface), surface.vertices
    space = motion_space(surface, classes, X)

    def forces(X):
        return motion_space(surface, classes, X).project(energy_and_gradient(surface, X)[1])

    here = linearise(surface, classes, space, X, energy_and_gradient(surface, X)[1])
    s = np.random.default_rng(0).standard_normal(space.size)
    d = space.to_vectors(s / np.abs(s).max())
    t = 1e-5 * surface.size
    numeric = space.to_coordinates((forces(X + t * d) - forces(X - t * d)) / (2 * t))
    assert np.abs(here(d) - numeric).max() < 1e-7 * np.abs(numeric).max()


def test_schwarz_p():
    """Eight pieces between mirror planes are a cubic cell of Schwarz' P surface; its area with order 2."""
    errors = []
    for rings in (4, 8, 16):
        result = pcmc.solve(schwarz_p(rings), target="stationary")
        assert result.converged
        errors.append(8 * result.energy - AREA)
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert np.abs(orders - 2.0).max() < 0.05
    assert abs((4 * errors[2] - errors[1]) / 3) < 2e-5
    cell = mirrored(result.surface, ["x = 0", "y = 0", "z = 0"])
    assert pcmc.energy(cell) == pytest.approx(8 * result.energy, rel=1e-12)
    assert len(cell.topology.boundary_loops) == 6
    assert cell.mirror_edge.sum() == cell.topology.boundary_edge.sum()
    assert len(np.unique(cell.topology.components)) == 1


def test_barrel():
    """Between two mirror planes a long barrel under pressure: the cylinder of radius α / p, order 2."""
    radius, errors = 2.0, []
    centre = -np.sqrt(radius**2 - 1.0)
    section = radius**2 * np.arcsin(1.0 / radius) + centre
    for n in (8, 16, 32):
        vault = pcmc.solve(barrel(n, alpha=radius)).surface
        off = np.hypot(vault.vertices[:, 0], vault.vertices[:, 2] - centre) - radius
        errors.append([np.abs(off).max(), abs(patch_volumes(vault)[0] - section)])
        assert pcmc.certify(vault).verdict.name == "STABLE"
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert np.abs(orders - 2.0).max() < 0.05


def octant(levels):
    """An eighth of a sphere of radius 1.9 between three mirror planes."""
    planes = {Plane(normal=tuple(n), mirror=True): np.flatnonzero(n == 0) for n in np.eye(3)}
    one = Surface(np.eye(3), [[0, 1, 2]], [0], [Patch("bubble", 1.0)], on_planes=planes)
    piece = refine(one, levels)
    return piece.moved(1.9 * piece.vertices / np.linalg.norm(piece.vertices, axis=1)[:, None])


def test_a_sphere_from_its_eighth():
    """Three planes at right angles: no vertex is held, corners slide along axes; the radius is 2 α / p."""
    assert len(octant(1).meeting_lines) == 3
    errors = []
    for levels in (2, 3, 4):
        result = pcmc.solve(octant(levels), target="stationary")
        assert result.converged
        errors.append(np.abs(np.linalg.norm(result.surface.vertices, axis=1) - 2.0).max())
        assert result.certify().index == 1  # it may grow, or shrink to nothing
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert np.abs(orders - 2.0).max() < 0.2
    with pytest.warns(FreeSurfaceWarning):
        whole = mirrored(result.surface)
    assert not whole.topology.boundary_edge.any()
    assert whole.m == 8 * result.surface.m
    assert pcmc.certify(whole).index == 1


def test_walls_at_an_axis_are_numbered():
    whole = mirrored(quarter_of_fans())
    assert [patch.name for patch in whole.patches] == [
        "fan 1",
        "fan 4",
        "wall 1",
        "wall 1 (2)",
        "wall 1 (3)",
        "wall 1 (4)",
    ]


def test_refining_keeps_the_mirror():
    piece = refine(cut(two_squares(4), MIDDLE))
    assert pcmc.energy(mirrored(piece)) == pytest.approx(pcmc.energy(refine(two_squares(4))), rel=1e-13)


def test_a_pinched_wall_ends_at_a_mirror_plane(tmp_path):
    """There its triangles have no area, in the half as in the whole; cables run along its top and foot."""
    whole = two_squares(6, alpha_aux=3.0)
    edges, low = whole.topology.edges, whole.vertices[:, 2] == 0.0
    on_wall = np.isin(np.arange(whole.n), whole.faces[whole.patch_of_face == 2])
    foot = edges[(low & on_wall)[edges].all(axis=1)]
    top = edges[whole.topology.junction_edge]
    tied = dataclasses.replace(whole, cables=[Cable("foot", 0.5, foot), Cable("top", 0.25, top)])
    result = pcmc.solve(cut(tied, MIDDLE))
    assert result.certificate.verdict.name == "STABLE"
    assert not result.surface.vertices[np.unique(result.surface.cables[1].edges), 2].any()
    assert refine(result.surface).m == 4 * result.surface.m
    path = tmp_path / "half.pcmc"
    pcmc.write(path, result.surface)
    again = pcmc.read(path)
    assert pcmc.energy(again) == pcmc.energy(result.surface)
    assert pcmc.certify(mirrored(again)).residual < 1e-10


def half_tent(**more):
    """Two triangles on one side of the plane x = 0, which they meet in the edge from 0 to 2 and to 3."""
    wall = Plane(normal=(1, 0, 0), name="wall", mirror=True)
    X = [[0, 0, 0], [1, 0, 0], [0, 1, 1], [0, -1, 1], [1, 1, 0]]
    F, patches = [[0, 1, 2], [0, 3, 1], [1, 4, 2]], [Patch("a", 1.0, weight=0.5), Patch("b", 2.0)]
    more = {"fixed": [1, 4], "on_planes": {wall: [0, 2, 3]}} | more
    return Surface(X, F, [0, 1, 0], patches, **more)


def test_cables_weights_and_rooms_are_carried():
    piece = half_tent(
        cables=[Cable("ridge", 1.5, [[0, 2]]), Cable("edge", 2.0, [[1, 4]])],
        rooms=[Room("inside", {"a": 1, "b": 1}, 0.4)],
    )
    whole = mirrored(piece)
    assert [patch.weight for patch in whole.patches] == [0.5, 0.0]
    cables = [(cable.name, cable.tension, len(cable.edges)) for cable in whole.cables]
    assert cables == [("ridge", 3.0, 1), ("edge", 2.0, 1), ("edge (2)", 2.0, 1)]
    assert (whole.rooms[0].name, whole.rooms[0].volume) == ("inside", 0.8)
    again = cut(whole, piece.on_planes[0][0])
    assert [cable.tension for cable in again.cables] == [1.5, 2.0]
    assert again.rooms[0].volume == 0.4


def test_a_cable_in_one_of_two_mirror_planes_has_its_tension_twice_and_its_length_twice():
    """A quarter of a tent: the plane y = 0 cuts its ridge in half, and the ridge lies in x = 0."""
    planes = [Plane(normal=axis, mirror=True) for axis in ((1, 0, 0), (0, 1, 0))]
    X = [[0, 0, 1], [1, 0, 0.5], [1, 1, 0], [0, 1, 0.5]]
    piece = Surface(
        X,
        [[0, 1, 2], [0, 2, 3]],
        [0, 0],
        [Patch("tent", 1.0)],
        fixed=[2],
        on_planes={planes[0]: [0, 3], planes[1]: [0, 1]},
        cables=[Cable("ridge", 1.5, [[0, 3]])],
    )
    whole = mirrored(piece)
    (ridge,) = whole.cables
    ends = whole.vertices[ridge.edges]
    assert (ridge.tension, len(ridge.edges)) == (3.0, 2)
    np.testing.assert_allclose(np.sort(ends[:, :, 1].ravel()), [-1.0, 0.0, 0.0, 1.0])
    np.testing.assert_array_equal(ends[:, :, 0], 0.0)
    assert pcmc.energy(whole) == pytest.approx(4.0 * pcmc.energy(piece), rel=1e-14)


def test_rooms_that_do_not_meet_stay_apart():
    X, F = [[1, 0, 0], [2, 0, 0], [1, 1, 0], [1, 0, 1], [0, 5, 0], [0, 6, 0], [1, 5, 0]], None
    F = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [4, 6, 5]]
    away = Plane(normal=(1, 0, 0), mirror=True)
    patches = [Patch("cell", 1.0), Patch("sail", 1.0, 0.0)]
    room = Room("cell", {"cell": 1}, 1 / 6)
    piece = Surface(X, F, [0] * 4 + [1], patches, fixed=[6], on_planes={away: [4, 5]}, rooms=[room])
    whole = mirrored(piece)
    assert [patch.name for patch in whole.patches] == ["cell", "cell (2)", "sail"]
    assert [(room.name, room.patches, room.volume) for room in whole.rooms] == [
        ("cell", (("cell", 1),), 1 / 6),
        ("cell (2)", (("cell (2)", 1),), 1 / 6),
    ]


def test_lines_circles_and_other_planes_are_carried():
    slope, ring = Plane((0, 0, 0), (1, 0, -1)), Circle((0, 0, 0), (0, 0, 1), 1.0)
    piece = half_tent(
        fixed=[],
        on_line={ring: [1], Line((1, 1, 0), (0, 1, 0)): [4]},
        on_planes={half_tent().on_planes[0][0]: [0, 2, 3], slope: [0]},
    )
    whole = mirrored(piece)
    assert sorted(mask.sum() for _, mask in whole.given_supports.on_line) == [1, 1, 2]
    assert len(whole.on_planes) == 2
    assert all(mask.tolist()[0] for _, mask in whole.on_planes)


def test_what_mirrored_refuses():
    with refused(SurfaceError, what="on_planes"):
        mirrored(two_squares(2))
    with refused(SurfaceError, what="planes"):
        mirrored(barrel(2))
    with refused(OptionError, what="planes", found="lid"):
        mirrored(barrel(2), ["lid"])
    with refused(SurfaceError, what="planes", found="mirror plane through (0, 0, 0) across (0, 0, 1)"):
        mirrored(barrel(2), [Plane(mirror=True)])
    assert len(mirrored(barrel(2), ["front"]).on_planes) == 2
    turn = np.radians(100.0)  # two images at 100° overlap a third
    sector = {
        Plane(normal=(0, 1, 0), mirror=True): [0, 1],
        Plane(normal=(np.sin(turn), -np.cos(turn), 0), mirror=True): [0, 2],
    }
    X = [[0, 0, 0], [1, 0, 0], [np.cos(turn), np.sin(turn), 0], [0.6, 0.6, 0.1]]
    wedge = Surface(X, [[0, 1, 3], [0, 3, 2]], [0, 0], [Patch("a", 1.0)], fixed=[3], on_planes=sector)
    with refused(SurfaceError, what="planes"):
        mirrored(wedge)
    ridge = Cable("ridge", 1.0, [[0, 2], [1, 4]])
    with refused(SurfaceError, what="cables", where="ridge"):
        mirrored(half_tent(cables=[ridge]))


def test_mirrors_of_rounded_coordinates_are_told_the_angle():
    far = [3.0, 5.196]
    mirrors = [[[0, 0], [6, 0]], [[0, 0], far]]
    sixth = Plan([[0, 0], [6, 0], far], mirrors=mirrors, edge_length=2.0, tension=1.6, pressure=0.4)
    words = r"meet at 59\.9992722°, not at 180° over a whole number such as 60°; give the ends of the mirrors"
    with pytest.raises(SurfaceError, match=words):
        mirrored(sixth.surface())


def test_mirrors_around_a_triangle_never_end_though_none_are_parallel():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0], [0.5, 0.75**0.5 / 3.0, 0.2]])
    sides = [(0, 1), (1, 2), (2, 0)]
    across = [np.cross(corners[end] - corners[start], [0, 0, 1]) for start, end in sides]
    planes = {Plane(corners[side[0]], n, mirror=True): side for side, n in zip(sides, across, strict=True)}
    faces, roof = [[0, 1, 3], [1, 2, 3], [2, 0, 3]], [Patch("roof", 1.0)]
    piece = Surface(corners, faces, [0] * 3, roof, fixed=[3], on_planes=planes)
    with pytest.raises(
        SurfaceError, match="never end: some planes are parallel, or nearly, or enclose a prism"
    ):
        mirrored(piece)
    assert mirrored(piece, list(planes)[:2]).m == 18


def test_what_mirror_planes_refuse():
    whole = two_squares(4)
    given = whole.vertices, whole.faces, whole.patch_of_face, whole.patches
    across = Plane(normal=(0, 1, 0), name="across", mirror=True)
    with refused(SurfaceError, what="on_planes", where="mirror plane 'across'") as caught:
        Surface(*given, whole.fixed, whole.on_plane, on_planes={across: np.abs(whole.vertices[:, 1]) < 1e-9})
    assert "pcmc.cut(surface, plane)" in str(caught.value)
    with refused(SurfaceError, what="on_planes", where="wall"):
        cut(whole, Plane(normal=(1, 0, 0)))
    with refused(SurfaceError, what="plane") as caught:
        cut(whole, Plane((0, 0.3, 0), (0, 1, 0)))
    assert "crosses" in str(caught.value)
    for place, side in ((-9, "in front of"), (9, "behind")):
        with refused(SurfaceError, what="plane", where=side):
            cut(whole, Plane((0, place, 0), (0, 1, 0)))
    with refused(SurfaceError, what="plane"):
        cut(whole, 3)


def test_a_surface_that_is_not_symmetric_is_not_cut():
    saddle = hypar_roof(4)  # its corners are at the heights 4 and 0 in turn
    with refused(SurfaceError, what="plane", where="(-5, -5, 4)") as caught:
        cut(saddle, Plane(normal=(0, -1, 0)))
    assert str(caught.value).endswith("the fixed vertex at (-5, -5, 4) has no image at (-5, 5, 4)")
    level = hypar_roof(4, height=0.0)
    assert cut(level, Plane(normal=(1, 0, 0))).m == level.m // 2
    with refused(SurfaceError, what="plane", where="cable 'east'"):
        cut(level.retensioned(cables={"east": 11.0}), Plane(normal=(1, 0, 0)))
    with refused(SurfaceError, what="plane", where="patch 'fan 1'"):
        cut(four_fans(4, mesh="double").retensioned({"fan 1": 9.0}), DIAGONALS[0])


def test_the_whole_on_the_command_line(tmp_path, monkeypatch, capsys):
    """convert and plot unfold a piece, with its scalars; without a mirror plane they say what is missing."""
    monkeypatch.chdir(tmp_path)
    piece = cut(spherical_cap(edge_length=0.4), MIDDLE)
    values = {"height": piece.vertices[:, 2], "patch": np.zeros(piece.m)}
    pcmc.write("half.pcmc", piece, scalars=values)
    assert cli.main(["convert", "half.pcmc", "whole.pcmc", "--whole"]) == 0
    whole = load("whole.pcmc")
    assert len(whole.faces) == 2 * piece.m
    np.testing.assert_allclose(whole.scalars["height"], whole.vertices[:, 2], atol=1e-14)
    assert cli.main(["plot", "half.pcmc", "whole.png", "--whole"]) == 0
    assert (tmp_path / "whole.png").read_bytes().startswith(b"\x89PNG")
    assert cli.main(["convert", "whole.pcmc", "again.pcmc", "--whole"]) == 2
    assert "no mirror plane" in capsys.readouterr().err


def test_a_prescribed_volume_in_an_eighth():
    """An eighth of a bubble with an eighth of its volume: stable; the whole keeps volume and energy."""
    volume, start = np.pi / 6.0, octant(3)
    room = Room("inside", {"bubble": 1}, volume)
    piece = start.rebuilt(rooms=[room])
    result = pcmc.solve(piece)
    assert result.converged
    assert result.certify().index == 0
    assert result.surface.patches[0].pressure == pytest.approx(2.0, rel=0.01)
    whole = mirrored(result.surface)
    assert whole.rooms[0].volume == 8 * volume
    certificate = pcmc.certify(whole)
    assert (certificate.verdict.name, certificate.index) == ("NEUTRAL", 0)
    assert certificate.energy == pytest.approx(8 * result.energy, rel=1e-12)
