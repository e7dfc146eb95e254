"""Vertices that are images of others: what makes a periodic surface, its topology, and what it cannot do."""

import pickle

import numpy as np
import pytest
from periodic_cases import bay, scattered, tube
from refusals import refused

import pcmc
from generators import kelvin_foam, minimal_cell
from pcmc import Cable, Line, Patch, Plane, Surface, images_in
from pcmc.base.errors import OptionError, SurfaceError
from pcmc.drawings import drawing_set
from pcmc.meshing.elevation import elevate
from pcmc.meshing.local_refinement import refine_faces
from pcmc.meshing.refinement import prolongation, refine
from pcmc.meshing.remeshing import remesh
from pcmc.report.document import roof_report
from pcmc.surface.images import lattice_of
from pcmc.surface.sections import section


def euler(surface):
    used = np.unique(surface.topology.faces)
    return len(used) - len(surface.topology.edges) + surface.m


@pytest.mark.parametrize("kind", ["P", "D", "G"])
def test_a_minimal_cell_is_closed_and_has_genus_3(kind):
    cell = minimal_cell(kind)
    assert not cell.topology.boundary_edge.any()
    assert not cell.topology.one_way_edge.any()
    assert euler(cell) == 2 - 2 * 3
    assert len(np.unique(cell.topology.components)) == 1


def test_refined_cells_have_the_same_topology_and_lattice():
    foam = kelvin_foam(0)
    fine = refine(foam, 2)
    assert not fine.topology.boundary_edge.any()
    assert (fine.topology.valence == 3).sum() == 4 * (foam.topology.valence == 3).sum()
    assert abs(np.linalg.det(lattice_of(fine))) == pytest.approx(0.5)
    assert pcmc.energy(fine) == pytest.approx(pcmc.energy(foam), rel=1e-14)
    vault = refine(bay(3))
    assert vault.fixed.sum() == 14
    assert np.array_equal(*vault.fixed[vault.images].T)
    assert refine(tube(3.0)).rooms == tube(3.0).rooms != ()


def test_a_lattice_is_found_from_any_of_its_translations():
    cell = minimal_cell("G")
    for seed in range(3):
        found = lattice_of(scattered(cell, lattice_of(cell), seed))
        whole = found @ np.linalg.inv(lattice_of(cell))
        assert whole == pytest.approx(np.round(whole))
        assert abs(np.linalg.det(whole)) == pytest.approx(1.0)
    assert lattice_of(tube(3.0)).tolist() == [[0.0, 0.0, 3.0]]


def test_images_are_kept_in_memory_and_in_files(tmp_path):
    cell = minimal_cell("P")
    pcmc.write(tmp_path / "cell.pcmc", cell)
    for again in (pcmc.read(tmp_path / "cell.pcmc"), pickle.loads(pickle.dumps(cell)), cell.rebuilt()):
        assert np.array_equal(again.images, cell.images)
        assert not again.topology.boundary_edge.any()
        assert pcmc.energy(again) == pcmc.energy(cell)


@pytest.mark.parametrize("suffix", ["fe", "obj", "ply", "stl", "vtp", "glb"])
def test_other_files_have_the_cell_alone_and_say_so(tmp_path, suffix):
    with pytest.warns(pcmc.errors.LostWarning, match="images of others"):
        pcmc.write(tmp_path / f"cell.{suffix}", minimal_cell("P"))


@pytest.mark.filterwarnings("ignore:no vertex is fixed")
def test_the_cell_alone_has_its_seam_as_boundary():
    alone = minimal_cell("P").cell
    assert not alone.periodic
    assert alone.cell is alone
    assert alone.topology.boundary_edge.sum() == 48


SQUARE = [[x, y, 0.0] for y in range(3) for x in range(4)]
CORNERS = [[i + 4 * j, i + 1 + 4 * j, i + 5 + 4 * j, i + 4 + 4 * j] for j in range(2) for i in range(3)]
FACES = [face for a, b, c, d in CORNERS for face in ([a, b, c], [a, c, d])]
PAIRS = [[3, 0], [7, 4], [11, 8]]


def strip(**changes):
    """A flat strip of 3 x 2 squares, periodic along x, with changes."""
    parts = {"patches": [Patch("strip", 1.0)], "images": PAIRS, "fixed": range(12)} | changes
    return Surface(SQUARE, FACES, [0] * 12, **parts)


def test_a_strip_is_a_ring():
    ring = strip()
    assert ring.topology.boundary_edge.sum() == 6
    assert len(ring.topology.boundary_loops) == 2
    assert all(loop.closed for loop in ring.topology.boundary_loops)


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"images": [*PAIRS, [3, 4]]}, 0),
        ({"images": [[3, 0], [2, 3]]}, 0),
        ({"images": [[3, 0], [7, 4], [11, 11]]}, 2),
        ({"images": PAIRS, "fixed": [0]}, 0),
        ({"images": PAIRS, "fixed": (), "on_plane": [0, 7]}, 0),
        ({"images": [[30, 0]]}, 0),
    ],
)
def test_pairs_that_are_no_images_are_refused(changes, where):
    with refused(SurfaceError, what="images", where=where):
        strip(**changes)


def test_images_need_pairs():
    with refused(SurfaceError, what="images"):
        strip(images=[0, 3])


def test_meshes_too_coarse_for_a_cell_are_refused():
    with refused(SurfaceError, what="faces", where=0):  # an edge from a vertex to its image
        strip(images=[[1, 0], [5, 4], [9, 8]])
    with refused(SurfaceError, what="faces"):  # two edges between the same two vertices
        strip(images=[[2, 0], [6, 4], [10, 8]])


@pytest.mark.parametrize(
    "part",
    [
        {"cables": [Cable("c", 1.0, [[0, 1]])]},
        {"on_line": {Line((0, 0, 0), (1, 0, 0)): [1]}, "fixed": ()},
        {"on_planes": {Plane((0, 0, 0), (0, 1, 0)): [1]}, "fixed": ()},
    ],
)
def test_what_a_periodic_surface_cannot_have_is_refused(part):
    with refused(SurfaceError, what="images"):
        strip(**part)


def test_curved_elements_are_refused():
    with refused(SurfaceError, what="images", found=["order"]):
        refine(strip()).rebuilt(order=2)


def test_weights_need_translations_along_the_plane():
    heavy = [Patch("strip", 1.0, weight=0.1)]
    assert strip(patches=heavy).periodic
    upright = Plane((0, 0, 0), (1, 0, 0))
    with refused(SurfaceError, what="weights", found=["a translation of images leads away from"]):
        strip(patches=heavy, plane=upright)
    with refused(SurfaceError, what="weights"):
        strip(plane=upright).retensioned(weights={"strip": 0.1})


def test_pressure_at_a_free_edge_is_refused():
    with refused(SurfaceError, what="images"):
        pcmc.energy(strip(fixed=[0, 3]))


def test_vertices_that_are_almost_images_are_named():
    with pytest.raises(SurfaceError, match=r"vertices 0 and 1 are images .* but for 3e-07 \(1 such"):
        images_in([[0, 0, 0], [1, 0, 3e-7], [0.5, 0.5, 0], [0.5, 0.5, 3e-7]], [[1, 0, 0]])


def test_a_lattice_needs_independent_translations():
    wrong = ([], [[0, 0, 0]], [[1, 0, 0], [2, 0, 0]], np.ones((4, 3)), np.ones((3, 2)), [[np.nan, 0, 0]], "a")
    for lattice in wrong:
        with refused(SurfaceError, what="lattice"):
            images_in(SQUARE, lattice)


def test_images_move_with_their_vertices():
    cell = minimal_cell("P")
    assert np.array_equal(cell.moved(cell.vertices + 1.0).images, cell.images)
    with refused(SurfaceError, what="images"):
        cell.moved(1.1 * cell.vertices)
    larger = cell.rebuilt(vertices=1.1 * cell.vertices)
    assert pcmc.energy(larger) == pytest.approx(1.1**2 * pcmc.energy(cell))


@pytest.mark.parametrize(
    "act",
    [
        lambda s: pcmc.cut(s, Plane()),
        pcmc.mirrored,
        lambda s: section(s, np.zeros(3), np.eye(3)[2]),
        lambda s: elevate(s, 2),
        lambda s: remesh(s, 0.1),
        lambda s: refine_faces(s, np.ones(s.m, dtype=bool)),
        prolongation,
        lambda s: drawing_set(s, "m"),
        lambda s: roof_report(s, "m"),
        lambda s: pcmc.follow(s, "pressure", 1.0),
        lambda s: pcmc.panels(s, 0.1),
        pcmc.check_mesh,
        pcmc.verify,
        pcmc.find_equilibria,
        lambda s: pcmc.explore.start(s),
    ],
)
def test_what_knows_of_no_images_refuses_them(act):
    with refused(SurfaceError, what="images"):
        act(minimal_cell("P"))


@pytest.mark.parametrize("method", ["nesterov", "lbfgs"])
def test_other_solvers_refuse_periodic_surfaces(method):
    with refused(OptionError, what="method"):
        pcmc.solve(minimal_cell("P"), method=method)


def test_walls_that_slide_refuse_images():
    X = [[x, y, z] for z in (1, 0) for y in (0, 1) for x in range(4)]
    X = [*X[:8], *X[8:12]]
    roof = [face for i in range(3) for face in ([i, i + 1, i + 5], [i, i + 5, i + 4])]
    wall = [face for i in range(3) for face in ([i, i + 8, i + 9], [i, i + 9, i + 1])]
    pairs = [[3, 0], [7, 4], [11, 8]]
    patches = [Patch("roof", 1.0, 1.0), Patch("wall", 1.0, 0.0)]
    hall = Surface(X, roof + wall, [0] * 6 + [1] * 6, patches, range(4, 8), range(8, 12), images=pairs)
    with refused(SurfaceError, what="images"):
        pcmc.solve(hall)
