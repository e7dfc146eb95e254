"""COMPAS meshes: surfaces there and back to the last bit, bad meshes by name, and a server in a process."""

from __future__ import annotations

import base64
import http.client
import json
import os
import socket
import subprocess
import sys
import time
import xmlrpc.client
from contextlib import closing
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refused
from starts import stationary
from tents import tent

import pcmc
from generators import two_squares
from pcmc.base.errors import FileWarning, MissingExtra, OptionError, SurfaceError
from pcmc.certificate.forces import reactions

compas_data = pytest.importorskip("compas.data")
rooms = pytest.importorskip("pcmc.compas")
from compas import rpc as compas_rpc  # noqa: E402
from compas.datastructures import Mesh  # noqa: E402

from pcmc.compas.__main__ import main as service_main  # noqa: E402
from pcmc.compas.server import set_up, settings_path  # noqa: E402


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


def assert_same(one: pcmc.Surface, two: pcmc.Surface) -> None:
    for name in ("vertices", "faces", "patch_of_face", "fixed", "on_plane"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), name)
    assert one.patches == two.patches
    assert one.plane == two.plane
    assert one.rooms == two.rooms
    assert [(c.name, c.tension, c.edges.tolist()) for c in one.cables] == [
        (c.name, c.tension, c.edges.tolist()) for c in two.cables
    ]
    assert [plane for plane, _ in one.on_planes] == [plane for plane, _ in two.on_planes]
    for (_, first), (_, second) in zip(one.on_planes, two.on_planes, strict=True):
        np.testing.assert_array_equal(first, second)
    assert [guide for guide, _ in one.on_line] == [guide for guide, _ in two.on_line]
    for (_, first), (_, second) in zip(one.on_line, two.on_line, strict=True):
        np.testing.assert_array_equal(first, second)


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
    force = reactions(surface)
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
    monkeypatch.setitem(sys.modules, "compas.datastructures", None)
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


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """What Proxy needs to call the service in a process of its own, and the folder that it may use."""
    home = tmp_path_factory.mktemp("home")
    folder = home / "roofs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(home))
        patch.setenv("USERPROFILE", str(home))
        path = set_up(folder)
        arguments = json.loads(path.read_text())["proxy"]
        command = [sys.executable, "-m", arguments["service"], "--port", str(arguments["port"])]
        with subprocess.Popen([*command, "--no-autoreload"]) as process:
            try:
                for _ in range(600):
                    with socket.socket() as probe:
                        address = ("127.0.0.1", arguments["port"])
                        if process.poll() is not None or probe.connect_ex(address) == 0:
                            break
                    time.sleep(0.1)
                yield arguments | {"max_conn_attempts": 1}, folder
            finally:
                process.kill()


@pytest.fixture
def proxy(service):
    """The service as a program calls it."""
    one = compas_rpc.Proxy(**service[0])
    yield one
    one._server("close")()


def test_the_service_solves_what_rhino_sends(proxy):
    start = two_squares(4, alpha_aux=1.0)
    meshes = rooms.to_meshes(start)
    assert_same(rooms.from_meshes(meshes), start)
    answer = proxy.solve(meshes, tensions={"left": 4.0}, method="newton")
    here = pcmc.solve(start.retensioned(tensions={"left": 4.0}), method="newton")
    assert (answer["converged"], answer["status"]) == (here.converged, here.status.name.lower())
    assert answer["energy"] == here.energy
    assert_same(rooms.from_meshes(answer["meshes"]), here.surface)
    verdict = proxy.certify(answer["meshes"])["verdict"]
    assert verdict == here.certificate.verdict.name.lower() == answer["certificate"]["verdict"]


BAD_VALUES = {
    "mesh": ({"tensions": {"lef": 4.0}}, "unknown mesh 'lef'; did you mean 'left'"),
    "list": ({"tensions": [1, 2]}, "tension of 'left': expected a finite number"),
    "NaN": ({"pressures": float("nan")}, "pressure of 'left': expected a finite number, found nan"),
    "weld": ({"weld": "yes"}, "weld: expected True or False, found 'yes'"),
    "option": ({"iteration": 3}, "did you mean 'iterations'"),
    "callback": ({"callback": "os.system"}, "callback: expected a function"),
    "attribute": (lambda m: m[0].attributes.update(weight="heavy"), "weight of 'left': expected a finite"),
    "cable": (lambda m: m[0].edgedata.update({"0-1": {"cable": ["a"]}}), "'cable' must be a name"),
    "edge": (lambda m: m[0].edgedata.update({"0": {"cable": "a"}}), "one is damaged"),
    "face": (lambda m: m[0].face.update({0: [[1], [2], [3]]}), "one is damaged"),
    "huge": (lambda m: m[0].vertex[0].update(x=10**400), "one is damaged"),
}


@pytest.mark.parametrize("case", BAD_VALUES)
def test_bad_values_end_in_one_line(proxy, case):
    change, expected = BAD_VALUES[case]
    meshes = rooms.to_meshes(two_squares(2, alpha_aux=1.0))
    if callable(change):
        change(meshes)
    with pytest.raises(compas_rpc.RPCServerError) as caught:
        proxy.solve(meshes, **({} if callable(change) else change))
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_service_knows_its_own_functions_only(service, tmp_path):
    made = tmp_path / "made"
    calls = {
        "os": lambda one: one.system(f"echo > {made}"),
        "subprocess": lambda one: one.run(["touch", str(made)]),
        "pcmc.compas.server": lambda one: one.set_up(str(tmp_path)),
        "pcmc": lambda one: one.write(str(made), []),
        "pcmc.compas": lambda one: one.to_meshes([]),
        "": lambda one: one._call("os.system"),
    }
    for package, call in calls.items():
        one = compas_rpc.Proxy(**service[0] | {"package": package})
        with pytest.raises((compas_rpc.RPCServerError, xmlrpc.client.Fault), match=r"unknown|not supported"):
            call(one)
        one._server("close")()
    assert not made.exists()


def test_an_object_that_is_no_mesh_is_not_imported(proxy, service):
    """COMPAS would import the module that the dict names; it lies where Python looks first."""
    module = Path(service[0]["working_directory"]) / "named_by_a_dict.py"
    module.write_text("raise SystemExit")
    with pytest.raises(compas_rpc.RPCServerError, match="meshes: expected a COMPAS Mesh"):
        proxy.solve({"dtype": "named_by_a_dict/Thing", "data": {}})


def asked(arguments, method="POST", changes=()):
    """Status and text that a ping gets, as Proxy would send it but for some headers; None leaves one out."""
    user, _, host = arguments["url"].removeprefix("http://").partition("@")
    host = f"{host}:{arguments['port']}"
    body = xmlrpc.client.dumps((), "ping").encode()
    headers = {
        "Host": host,
        "Authorization": f"Basic {base64.b64encode(user.encode()).decode()}",
        "Content-Type": "text/xml",
        "Content-Length": str(len(body)),
        **dict(changes),
    }
    with closing(http.client.HTTPConnection(host, timeout=60)) as connection:
        connection.putrequest(method, "/", skip_host=True)
        for name, value in headers.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders(body)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


STRANGERS = {
    "no secret": (401, {"Authorization": None}),
    "wrong secret": (401, {"Authorization": "Basic cGNtYzpndWVzc2Vk"}),
    "a page": (403, {"Origin": "https://example.org"}),
    "a page on this computer": (403, {"Origin": "http://127.0.0.1:8000"}),
    "a page that says null": (403, {"Origin": "null"}),
    "another name of this computer": (403, {"Host": "example.org"}),
    "no name": (403, {"Host": None}),
    "a form": (415, {"Content-Type": "text/plain"}),
    "too large": (413, {"Content-Length": "500000001"}),
    "no size": (411, {"Content-Length": None}),
    "no end": (411, {"Transfer-Encoding": "chunked"}),
}


@pytest.mark.parametrize("case", STRANGERS)
def test_strangers_are_refused(service, case):
    status, changes = STRANGERS[case]
    assert asked(service[0])[0] == 200
    assert asked(service[0], changes=changes.items())[0] == status
    method = {"Origin": "OPTIONS"}.get(next(iter(changes)), "GET")  # the question that precedes a page's call
    assert asked(service[0], method, changes.items())[0] == status


def test_the_service_listens_on_the_loopback_alone(service):
    """No other address of this computer is answered; a silent connection does not keep others waiting."""
    port = service[0]["port"]
    with socket.socket() as silent, socket.socket() as other:
        silent.connect(("127.0.0.1", port))
        assert asked(service[0])[0] == 200
        assert other.connect_ex(("127.0.0.2", port)) != 0


def test_files_stay_in_the_folder(proxy, service, tmp_path):
    folder, meshes = service[1], rooms.to_meshes(two_squares(2))
    (folder / "inner").mkdir(exist_ok=True)
    proxy.write("inner/a.pcmc", meshes)
    assert_same(rooms.from_meshes(proxy.read("inner/a.pcmc")), two_squares(2))
    with pytest.raises(compas_rpc.RPCServerError, match="exists; pass overwrite=True to replace it"):
        proxy.write("inner/a.pcmc", meshes)
    proxy.write(str(folder / "inner" / "a.pcmc"), meshes, overwrite=True)
    os.mkfifo(folder / "pipe.obj")
    with pytest.raises(compas_rpc.RPCServerError, match="a pipe or a device"):
        proxy.write("pipe.obj", meshes, overwrite=True)
    outside = tmp_path / "b.pcmc"
    pcmc.write(outside, two_squares(2))
    before = outside.read_bytes()
    for name, target in {"link": tmp_path, "loop": folder / "loop", "b.pcmc": outside}.items():
        (folder / name).symlink_to(target)
    ways_out = [str(outside), "../b.pcmc", "link/b.pcmc", "b.pcmc", "inner/../../b.pcmc", "link/new.pcmc"]
    for path in ways_out:
        with pytest.raises(compas_rpc.RPCServerError, match="is outside"):
            proxy.read(path)
        with pytest.raises(compas_rpc.RPCServerError, match="is outside"):
            proxy.write(path, meshes, overwrite=True)
    for path in (3, ["a"], "a\0.pcmc", "loop/a.pcmc", "missing.pcmc", "inner", "\ud800.pcmc"):
        with pytest.raises(compas_rpc.RPCServerError) as caught:
            proxy.read(path)
        assert "\n" not in str(caught.value)
    assert outside.read_bytes() == before
    assert not (tmp_path / "new.pcmc").exists()


def test_settings_are_the_owners_and_a_new_secret_counts_at_once(service, monkeypatch, capsys):
    path, folder = settings_path(), service[1]
    assert path.stat().st_mode & 0o077 == 0
    old = service[0]
    kept = path.read_text()
    try:
        new = json.loads(set_up(folder).read_text())["proxy"]
        assert (new["port"], new["url"] == old["url"]) == (old["port"], False)
        assert (asked(old)[0], asked(new)[0]) == (401, 200)
        path.chmod(0o644)
        assert asked(new)[0] == 403
        for text, expected in {"": "damaged", '{"proxy": 3}': "damaged", None: "is missing"}.items():
            path.unlink()
            if text is not None:
                path.touch(0o600)
                path.write_text(text)
            assert asked(new)[0] == 403
            monkeypatch.setattr(sys, "argv", ["compas"])
            assert service_main() == 2
            assert expected in capsys.readouterr().err
    finally:
        path.unlink(missing_ok=True)
        path.touch(0o600)
        path.write_text(kept)
    for options, expected in {
        ("--folder", str(path)): "cannot be the folder",
        ("--folder", str(path / "missing" / "a")): "cannot be the folder",
        ("--port", str(old["port"])): "cannot be opened",
        ("--port", "99999999"): "cannot be opened",
    }.items():
        monkeypatch.setattr(sys, "argv", ["compas", *options])
        assert service_main() == 2
        error = capsys.readouterr().err
        assert expected in error
        assert error.count("\n") == 1


def test_the_lines_for_rhino(service, monkeypatch, capsys):
    """With a mesh drawn here in place of Rhino's."""
    drawn = rooms.to_meshes(two_squares(4, alpha_aux=1.0))
    for mesh, name in zip(drawn, ("west", "east", "wall"), strict=True):
        mesh.name = name

    def bare(mesh):
        """As Rhino has it: places and faces, each mesh with its own keys."""
        keys = list(mesh.vertices())
        faces = [[keys.index(v) for v in mesh.face_vertices(f)] for f in mesh.faces()]
        return Mesh.from_vertices_and_faces([mesh.vertex_coordinates(key) for key in keys], faces)

    rhino = SimpleNamespace(
        filter=SimpleNamespace(mesh=32),
        GetObjects=lambda message, kind: drawn,
        ObjectName=lambda mesh: mesh.name,
        coercemesh=bare,
    )
    monkeypatch.setitem(sys.modules, "rhinoscriptsyntax", rhino)
    monkeypatch.setitem(sys.modules, "compas_rhino", SimpleNamespace())
    conversions = SimpleNamespace(mesh_to_compas=lambda mesh: mesh)
    monkeypatch.setitem(sys.modules, "compas_rhino.conversions", conversions)
    monkeypatch.setattr("compas.scene.Scene.draw", lambda scene: None)  # it needs a program to draw in
    page = Path(__file__).parents[2] / "docs" / "how-to" / "compas.md"
    names = {}
    code = page.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    try:
        exec(compile(code, "compas.md", "exec"), names)
    finally:
        names["pcmc"]._server("close")()
    assert names["answer"]["converged"]
    assert [mesh.name for mesh in names["answer"]["meshes"]] == ["west", "east", "wall"]
    assert names["answer"]["certificate"]["certified"]
    assert [item.item.name for item in names["scene"].objects] == ["west", "east", "wall"]
    assert len(names["answer"]["warnings"]) == 1
    assert "is_support" in names["answer"]["warnings"][0]
