"""COMPAS meshes: surfaces there and back to the last bit, and bad meshes by name."""

from __future__ import annotations

import sys
from functools import partial

import numpy as np
import pytest
from refusals import refused
from same_surface import assert_same
from starts import stationary
from tents import tent

import pcmc
from generators import two_squares
from pcmc.base.errors import FileWarning, MissingExtra, OptionError, SurfaceError
from pcmc.certificate.forces import support_forces

compas_data = pytest.importorskip("compas.data")
rooms = pytest.importorskip("pcmc.compas")
from compas.datastructures import Mesh  # noqa: E402


def sliding() -> pcmc.Surface:
    """A square that slides along a line, a circle and a tilted Π; one patch is a wall by its flag."""
    rng = np.random.default_rng(3)
    normal = np.array([1.0, 2.0, 4.0])
    X = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.4, 0.6, 0]], dtype=float)
    X = X @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3)
    line = pcmc.Line(tuple(X[0]), tuple(X[1] - X[0]))
    circle = pcmc.Circle(tuple(X[2] + [0.0, 0.0, 0.7]), (0.0, 1.0, 0.0), 0.7)
    return pcmc.Surface(
        X,
        [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
        [1, 0, 1, 0],
        [pcmc.Patch("Süd", 1 / 3, 0.1, wall=True), pcmc.Patch("b", 0.7)],
        on_plane=[3],
        plane=pcmc.Plane(tuple(X[3]), tuple(normal)),
        on_line=[(line, [0, 1]), (circle, [2])],
    )


def arch() -> pcmc.Surface:
    """Two patches with weight on a mirror and a wall plane, two cables, and a room of prescribed volume."""
    X = [
        [0, 0, 0],
        [1, 0, 0.3],
        [2, 0, 0],
        [0, 1, 0.2],
        [1, 1, 0.5],
        [2, 1, 0],
        [0, 2, 0],
        [1, 2, 0],
        [2, 2, 0],
    ]
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    F = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mirror = pcmc.Plane((0, 0, 0), (0, 1, 0), name="axis", mirror=True)
    return pcmc.Surface(
        X,
        F,
        [0, 1, 0, 1] * 2,
        [pcmc.Patch("west", 2.0, weight=0.1, snow=0.2), pcmc.Patch("east", 1 / 3)],
        fixed=[6, 7, 8],
        on_planes={mirror: [0, 1], pcmc.Plane((0, 0, 0), (1, 0, 0)): [0, 3]},
        cables=[pcmc.Cable("ridge", 0.1, [[4, 1], [7, 4]]), pcmc.Cable("arch", 0.7, [[1, 2]])],
        rooms=[pcmc.Room("hall", {"west": 1, "east": 1}, 1.7)],
    )


def through_json(meshes):
    return compas_data.json_loads(compas_data.json_dumps(meshes))


def quads(nx=2):
    """A flat grid of quads without any attribute but the tension."""
    mesh = Mesh.from_meshgrid(dx=2.0, nx=nx)
    mesh.name = "grid"
    mesh.attributes["tension"] = 3.0
    return mesh


@pytest.mark.parametrize(
    "surface", [tent(), sliding(), two_squares(2), arch()], ids=["tent", "guides", "squares", "arch"]
)
def test_round_trip_through_json_is_exact(surface):
    meshes = through_json(rooms.to_meshes(surface))
    assert [type(mesh) for mesh in meshes] == [Mesh] * len(surface.patches)
    assert_same(rooms.from_meshes(meshes), surface)


def test_walls_without_height_stay():
    """Their triangles have no area, and their vertices lie on those of the junction."""
    surface = stationary(partial(two_squares, 8, alpha_aux=3.0)).surface
    again = rooms.from_meshes(through_json(rooms.to_meshes(surface)))
    assert_same(again, surface)
    pinched = pcmc.certify(again).pinched
    assert len(pinched) > 0
    np.testing.assert_array_equal(pinched, pcmc.certify(surface).pinched)


def test_meshes_carry_what_the_surface_is():
    surface = tent()
    meshes = rooms.to_meshes(surface)
    assert [mesh.name for mesh in meshes] == ["west side", "east", "wall"]
    assert [mesh.attributes["tension"] for mesh in meshes] == [3.0, 2.1, 0.7]
    assert [mesh.attributes["pressure"] for mesh in meshes] == [1.0, 0.5, 0.5]
    common = set(meshes[0].vertices()) & set(meshes[1].vertices())
    assert common == {0, 1, 2, 3}
    curvature = pcmc.mean_curvature(surface, "variational")
    force = support_forces(surface)
    for mesh in meshes:
        for key in mesh.vertices():
            assert mesh.vertex_coordinates(key) == surface.vertices[key].tolist()
            assert mesh.vertex_attribute(key, "is_support") == surface.fixed[key]
            assert mesh.vertex_attribute(key, "is_sliding") == surface.on_plane[key]
            assert mesh.vertex_attributes(key, ["rx", "ry", "rz"]) == force[key].tolist()
            h = mesh.vertex_attribute(key, "mean_curvature")
            assert (h is None) if np.isnan(curvature[key]) else h == curvature[key]
    assert meshes[0].is_valid()


def test_a_property_that_meshes_do_not_carry_is_refused(monkeypatch):
    carried = {"vertices", "faces", "patch_of_face", "patches", "plane"}
    monkeypatch.setattr("pcmc.compas.meshes.CARRIED", carried)
    with refused(SurfaceError, what="fixed"):
        rooms.to_meshes(tent())


def test_quads_are_cut_and_their_boundary_is_held():
    with pytest.warns(
        FileWarning, match=r"^meshes: 4 quads were cut into triangles; no vertex has"
    ) as caught:
        surface = rooms.from_meshes(quads())
    assert len(caught) == 1
    assert (surface.m, surface.fixed.sum()) == (8, 8)
    assert surface.patches == (pcmc.Patch("grid", 3.0),)


def test_names_of_other_packages_hold_a_vertex():
    for name in ("is_support", "is_anchor", "is_fixed"):
        mesh = quads()
        mesh.update_default_vertex_attributes({name: False})
        mesh.vertex_attribute(4, name, True)
        with pytest.warns(FileWarning, match="quads"):
            assert np.flatnonzero(rooms.from_meshes(mesh).fixed).tolist() == [4]


def test_meshes_that_do_not_share_keys():
    one, two = quads(), quads()
    two.name = "other"
    two.transform(pcmc_translation(2.0))
    with refused(SurfaceError, what="vertices", where="other"):
        rooms.from_meshes([one, two])
    with pytest.warns(FileWarning):
        surface = rooms.from_meshes([one, two], weld=True)
    assert (surface.n, surface.m) == (15, 16)
    assert len(surface.topology.junctions) == 1


def pcmc_translation(distance):
    from compas.geometry import Translation

    return Translation.from_vector([distance, 0.0, 0.0])


def changed(change):
    """The tent's meshes after a change."""
    meshes = rooms.to_meshes(tent())
    change(meshes)
    return meshes


BAD = {
    "planes": (lambda m: m[0].vertex[2].update(planes=[1]), "planes", None),
    "planes' sign": (lambda m: m[0].vertex[2].update(planes=[-1]), "planes", "west side"),
    "planes' kind": (lambda m: m[0].vertex[2].update(planes=1), "planes", "west side"),
    "no such edge": (lambda m: m[1].edgedata.update({"(4, 99)": {"cable": "c"}}), "cable", "east"),
    "loose cable": (lambda m: m[1].edge_attribute((2, 3), "cable", "c"), "cable", "east"),
    "two tensions": (
        lambda m: [
            one.edge_attributes((2, 3), ["cable", "tension"], ["c", t])
            for one, t in zip(m[:2], (1.0, 2.0), strict=True)
        ],
        "cable",
        "east",
    ),
    "tension": (lambda m: m[1].attributes.pop("tension"), "tension", "east"),
    "name": (lambda m: setattr(m[1], "name", "wall"), "meshes", "wall"),
    "nothing": (lambda m: m.clear(), "meshes", None),
    "no mesh": (lambda m: m.append(3), "meshes", None),
    "no faces": (lambda m: m.__setitem__(slice(None), [named(Mesh())]), "meshes", None),
    "coordinate": (lambda m: m[2].vertex[4].update(x="left"), "vertices", "wall"),
    "infinite": (lambda m: m[2].vertex[4].update(x=float("inf")), "vertices", "wall"),
    "corner": (lambda m: m[0].face.update({0: [0, 2, 99]}), "faces", "west side"),
    "guide": (lambda m: m[0].vertex[2].update(guide=0), "guide", None),
    "guide's kind": (lambda m: m[0].vertex[2].update(guide="a"), "guide", "west side"),
    "plane": (lambda m: m[0].attributes.update(pcmc={"plane": 3}), "pcmc", "west side"),
    "two planes": (lambda m: m[1].attributes.update(pcmc={}), "pcmc", "east"),
    "moved apart": (lambda m: m[2].vertex[2].update(x=0.0), "vertices", "wall"),
}


def named(mesh):
    mesh.name, mesh.attributes["tension"] = "empty", 1.0
    return mesh


@pytest.mark.parametrize("case", BAD)
def test_bad_meshes_are_refused_by_name(case):
    change, what, where = BAD[case]
    with refused(SurfaceError, what=what, where=where) as caught:
        rooms.from_meshes(changed(change))
    assert "\n" not in str(caught.value)


def test_values_in_place_of_the_attributes():
    meshes = changed(lambda m: m[1].attributes.pop("tension"))
    surface = rooms.from_meshes(meshes, tensions={"east": 2.1}, pressures=0.5)
    assert surface.tensions.tolist() == [3.0, 2.1, 0.7]
    assert surface.pressures.tolist() == [0.5] * 3
    with refused(OptionError, what="tensions", where="est"):
        rooms.from_meshes(meshes, tensions={"est": 2.1})


def test_unused_vertices_are_left_out():
    mesh = rooms.to_meshes(two_squares(2))[0]
    for name in ("pcmc", "tension"):
        assert name in mesh.attributes
    n = len(mesh.vertex)
    mesh.add_vertex(999, x=50.0)
    with pytest.warns(FileWarning, match="1 vertices that no face uses"):
        assert rooms.from_meshes(mesh).n == n


def test_without_compas(monkeypatch):
    monkeypatch.setitem(sys.modules, "compas", None)
    with pytest.raises(MissingExtra, match=r"compas is not installed.*pcmc-surfaces\[compas\]"):
        rooms.to_meshes(tent())
    with pytest.raises(MissingExtra):
        rooms.from_meshes([])


def test_read_write_and_certify(tmp_path):
    surface = two_squares(4, alpha_aux=1.0)
    rooms.write(tmp_path / "a.pcmc", rooms.to_meshes(surface))
    meshes = rooms.read(tmp_path / "a.pcmc")
    assert_same(rooms.from_meshes(meshes), surface)
    answer = rooms.certify(meshes)
    assert answer["verdict"] == pcmc.certify(surface).verdict.name.lower()
    assert [row["patch"] for row in answer["patches"]] == [p.name for p in surface.patches]
    assert "NaN" not in compas_data.json_dumps(answer)
