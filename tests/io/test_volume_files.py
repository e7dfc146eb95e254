"""Rooms of prescribed volume: kept by meshing, in files, and as Surface Evolver has them."""

import numpy as np
import pytest
from programs import needs_evolver
from volume_cases import cap, cylinder, raised

import generators
import pcmc
from pcmc import Line, Patch, Plane, Room, Surface
from pcmc.forces.rooms import prescribed_volumes, room_pressures, room_volumes, with_room_pressures
from pcmc.meshing.local_refinement import refine_faces
from pcmc.meshing.refinement import refine
from studies.reference import evolver


def test_meshes_made_from_a_surface_keep_its_rooms():
    surface = pcmc.solve(cap(1.0, 0.4)).surface
    fine = refine(surface)
    assert fine.rooms == surface.rooms
    assert refine_faces(surface, [0, 5]).rooms == surface.rooms
    result = pcmc.solve(surface, levels=1)
    assert result.converged
    assert result.surface.m == 4 * surface.m
    assert room_volumes(result.surface)[0] == pytest.approx(1.0, rel=1e-9)
    check = pcmc.check_mesh(surface)
    assert check.row("volume")["error"] == pytest.approx(0.0, abs=1e-8)


def test_a_remeshed_room_keeps_its_volume():
    pytest.importorskip("mmgpy")
    from pcmc.meshing.remeshing import remesh

    again = remesh(pcmc.solve(cap(1.0, 0.3)).surface, 0.2)
    assert room_volumes(pcmc.solve(again).surface)[0] == pytest.approx(1.0, rel=1e-9)


def test_sliding_along_a_line_off_the_plane_keeps_the_fan():
    X = [[0, 0, 1], [1, 0, 1], [2, 0, 1], [2, 2, 1], [0, 2, 1], [1, 1, 1.5]]
    F = [[0, 1, 5], [1, 2, 5], [2, 3, 5], [3, 4, 5], [4, 0, 5]]
    line = Line((0, 0, 1), (1, 0, 0))
    surface = Surface(X, F, [0] * 5, [Patch("roof", 1.0)], [0, 2, 3, 4], on_line={line: [1]},
                      rooms=[Room("r", {"roof": 1}, 1.0)])  # fmt: skip
    slid = surface.moved(surface.vertices + np.eye(3)[0] * 0.3 * (np.arange(6) == 1)[:, None])
    assert room_volumes(surface) == pytest.approx(2 / 3)
    assert room_volumes(slid) == pytest.approx(2 / 3)


@pytest.mark.parametrize("suffix", [".pcmc", ".fe"])
def test_files_carry_rooms(suffix, tmp_path):
    bubbles = generators.double_bubble(0.8, volumes=(1.0, 0.7))
    path = tmp_path / f"bubbles{suffix}"
    pcmc.write(path, bubbles)
    again = pcmc.read(path)
    assert again.rooms == bubbles.rooms
    np.testing.assert_allclose(again.pressures, bubbles.pressures, atol=1e-14)
    assert again.walls.tolist() == bubbles.walls.tolist()


def half_tent() -> Surface:
    """The half of a tent beside a mirror plane that does not pass through the point of Π."""
    mirror = Plane((5, 0, 0), (1, 0, 0), mirror=True)
    return Surface([[5, -1, 0], [6, 0, 0], [5, 1, 0], [5, 0, 1]], [[0, 1, 3], [1, 2, 3]], [0, 0],
                   [Patch("tent", 1.0, 0.0)], [0, 1, 2], on_planes={mirror: [0, 2, 3]},
                   rooms=[Room("r", {"tent": 1}, 0.4)])  # fmt: skip


@needs_evolver
@pytest.mark.parametrize("name", ["bubbles", "raised roof", "cap", "plates", "beside a mirror"])
def test_evolver_has_the_same_volumes_energy_and_gradient(name):
    bubbles = generators.double_bubble(0.8, volumes=(1.0, 0.7))
    surface = {
        "bubbles": bubbles,
        "raised roof": raised(),
        "cap": cap(1.0, 0.4),
        "plates": cylinder(0.6, 3.0, "plates"),
        "beside a mirror": half_tent(),
    }[name]
    out = evolver.run(surface, 'foreach body bb do printf "V %.17g %.17g\\n", bb.volume, bb.target')
    found = evolver.numbers(out, "V", 2)
    np.testing.assert_allclose(found[:, 0], room_volumes(surface), rtol=1e-12)
    np.testing.assert_allclose(found[:, 1], prescribed_volumes(surface), rtol=1e-12)
    np.testing.assert_allclose(evolver.positions(surface, ""), surface.vertices, atol=1e-14)
    # its energy leaves out the pressures of bodies whose volume is prescribed
    bare = with_room_pressures(surface, -room_pressures(surface))
    assert evolver.energy(surface) == pytest.approx(pcmc.energy(bare), rel=1e-12)
    forces = pcmc.gradient(bare)
    np.testing.assert_allclose(evolver.gradient(surface), forces, rtol=0, atol=1e-12 * abs(forces).max())


@needs_evolver
def test_evolver_stays_at_rest_where_we_do(tmp_path):
    surface = pcmc.solve(generators.double_bubble(0.6, volumes=(1.0, 0.7))).surface
    out = evolver.run(
        surface, 'hessian_normal on\nhessian\nforeach body bb do printf "P %.17g\\n", bb.pressure'
    )
    np.testing.assert_allclose(evolver.numbers(out, "P", 1)[:, 0], room_pressures(surface), rtol=1e-6)
    dump = tmp_path / "out.dmp"
    evolver.run(surface, f'dump "{dump}"')
    assert [room.volume for room in pcmc.read(dump).rooms] == [1.0, 0.7]
