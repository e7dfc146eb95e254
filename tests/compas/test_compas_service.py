"""The service that Rhino calls, in a process of its own: answers, bad values, strangers, files, settings."""

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
from pathlib import Path
from types import SimpleNamespace

import pytest
from same_surface import assert_same

import pcmc
from generators import two_squares

compas_data = pytest.importorskip("compas.data")
rooms = pytest.importorskip("pcmc.compas")
from compas import rpc as compas_rpc  # noqa: E402
from compas.datastructures import Mesh  # noqa: E402

from pcmc.base.compiled import KEPT_IN  # noqa: E402
from pcmc.compas.__main__ import command as service_main  # noqa: E402
from pcmc.compas.server import set_up, settings_path  # noqa: E402


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """What Proxy needs to call the service in a process of its own, and the folder that it may use."""
    home = tmp_path_factory.mktemp("home")
    folder = home / "roofs"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(home))
        patch.setenv("USERPROFILE", str(home))
        patch.setenv("NUMBA_CACHE_DIR", str(Path(KEPT_IN).parent))  # or all is compiled anew
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
    "huge": (lambda m: m[0].vertex[0].update(x=10**400), "set its x, y and z to finite numbers"),
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
