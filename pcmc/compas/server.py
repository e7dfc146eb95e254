"""The service that ``compas.rpc.Proxy`` starts: four functions, for its owner alone.

The service of COMPAS itself calls any function for everyone who reaches its port. This one listens on the
loopback, asks for the secret in its settings, refuses web pages, and reads and writes one folder.
"""

from __future__ import annotations

import base64
import hmac
import inspect
import json
import os
import secrets
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from socketserver import ThreadingMixIn
from typing import Any, NamedTuple
from xmlrpc.server import SimpleXMLRPCRequestHandler

from ..base import validate
from ..base.errors import FileError, MissingExtra, OptionError, PcmcError, unknown
from ..base.files import PathLike, atomic_write, check_name, check_regular, system_error, writing
from ..base.libraries import require
from . import meshes as service
from .mesh_arrays import damaged_mesh

require("compas", extra="compas")
from compas.data import DataDecoder, DataEncoder  # noqa: E402
from compas.rpc import Server  # noqa: E402

HOST = "127.0.0.1"
USER = "pcmc"
PACKAGE = "pcmc.compas"
LARGEST = 500_000_000  # bytes of a request: some two million triangles
SECONDS = 20.0  # that a connection may be silent
STARTS = 600  # of Proxy, a tenth of a second each: the first import after an installation takes long
MESH = "compas.datastructures/Mesh"


class Settings(NamedTuple):
    """Who may call, and what is read and written."""

    folder: Path  # that ``read`` and ``write`` are kept in
    secret: str  # what a request must show
    port: int  # where the service listens

    def place(self, path: object) -> Path:
        """The path of a file in the folder, links resolved; FileError for one that leads out of it."""
        if not isinstance(path, str):
            validate.refuse("path", path, "a text", error=FileError)
        check_name(Path(path))
        place = Path(os.path.realpath(self.folder / path))
        if not place.is_relative_to(self.folder):
            text = f"{validate.shown(path)}: is outside {self.folder}, the folder that pcmc may use"
            text = f"{text}; to name another: python -m {PACKAGE} --folder FOLDER"
            raise FileError(text, what=path, expected=str(self.folder))
        return place


def settings_path() -> Path:
    """The file of the settings, ``~/.pcmc/compas.json``."""
    return Path.home() / ".pcmc" / "compas.json"


def set_up(folder: PathLike) -> Path:
    """Let the service read and write a folder, made if it is missing; return the file of the settings.

    They have a new secret, and the port that they had. A service that runs goes on with them.
    """
    place = Path(os.path.realpath(Path(folder).expanduser()))
    try:
        place.mkdir(exist_ok=True)
    except OSError as error:
        text = f"{place}: cannot be the folder ({error.strerror or error}); name another"
        raise FileError(text, what=str(place)) from None
    path = settings_path()
    try:
        port = read_settings().port
    except FileError:
        port = 0
    while not port:  # one that no program uses, below those that systems give to connections
        tried = 20_000 + secrets.randbelow(10_000)
        with socket.socket() as probe:
            port = tried if probe.connect_ex((HOST, tried)) else 0
    secret = secrets.token_urlsafe(32)
    proxy = {
        "package": PACKAGE,
        "service": PACKAGE,
        "python": sys.executable,
        "url": f"http://{USER}:{secret}@{HOST}",
        "port": port,
        "autoreload": False,
        "max_conn_attempts": STARTS,
        "working_directory": str(path.parent),  # Python imports from there: not any folder
    }
    with writing(path):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with atomic_write(path) as temporary:
            temporary.touch(0o600)
            text = json.dumps({"folder": str(place), "proxy": proxy}, indent=2) + "\n"
            temporary.write_text(text, encoding="utf-8")
    return path


def read_settings() -> Settings:
    """The settings in their file; FileError if it is missing, damaged, or others can read it."""
    path = settings_path()
    make = f"python -m {PACKAGE} --folder FOLDER"
    check_regular(path)
    try:
        if os.name == "posix" and path.stat().st_mode & 0o077:
            text = f"{path}: others can read the secret in it; make a new one: {make}"
            raise FileError(text, what=str(path))
        values = json.loads(path.read_text(encoding="utf-8"))
        secret = values["proxy"]["url"].split(":")[2].partition("@")[0]
        settings = Settings(Path(os.path.realpath(values["folder"])), secret, int(values["proxy"]["port"]))
    except FileNotFoundError:
        raise FileError(f"{path}: is missing; make it: {make}", what=str(path)) from None
    except OSError as error:
        raise system_error(path, "read", error) from None
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        if isinstance(error, PcmcError):
            raise
        raise FileError(f"{path}: is damaged; make it anew: {make}", what=str(path)) from None
    if not secret:
        raise FileError(f"{path}: has no secret; make one: {make}", what=str(path))
    return settings


class CallHandler(SimpleXMLRPCRequestHandler):
    """Answers a request of the owner's program; refuses all others before their content is read."""

    timeout = SECONDS  # in seconds; a connection that says nothing holds a thread no longer
    rpc_paths = ("/", "/RPC2")

    def parse_request(self) -> bool:
        """Read the head of a request; False, with the refusal sent, for one that is not allowed."""
        if not super().parse_request():
            return False
        refusal = self._refusal()
        if refusal:
            self.close_connection = True
            self.send_error(*refusal)
        return refusal is None

    def _refusal(self) -> tuple[int, str] | None:
        """Status and sentence for a request that is not allowed."""
        port = self.connection.getsockname()[1]
        size = self.headers.get("Content-Length", "")
        if self.headers.get("Host") not in (f"{HOST}:{port}", f"localhost:{port}"):
            return 403, f"the service is {HOST}:{port} and has no other name"  # DNS rebinding
        if "Origin" in self.headers or "Sec-Fetch-Site" in self.headers:
            return 403, "web pages may not call this service"
        try:
            shown = f"{USER}:{read_settings().secret}".encode()
        except FileError as error:
            return 403, str(error).encode("latin-1", "replace").decode("latin-1")
        wanted = "Basic " + base64.b64encode(shown).decode()
        if not hmac.compare_digest(self.headers.get("Authorization", "").encode(), wanted.encode()):
            return 401, f"the secret is wrong or missing; pass Proxy the url in {settings_path().name}"
        if self.headers.get_content_type() != "text/xml":
            return 415, "send XML-RPC as text/xml"
        if "Transfer-Encoding" in self.headers or not (size.isascii() and size.isdigit()):
            return 411, "say the size of the request as Content-Length"
        if len(size) > 12 or int(size) > LARGEST:
            return 413, f"a request may have {LARGEST} bytes at most"
        return None

    def log_message(self, *_: object) -> None:
        """Print nothing: ``Proxy`` never reads what its server prints, and a full pipe would stop it."""


class LoopbackServer(ThreadingMixIn, Server):
    """The server on the loopback, a thread for each connection. It calls the functions of the service by
    name, one at a time, with arguments as COMPAS encodes them."""

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = os.name == "posix"  # elsewhere it lets another program take the same port

    def __init__(self, port: int) -> None:
        super().__init__((HOST, port), requestHandler=CallHandler, logRequests=False)
        self._lock = threading.Lock()  # warnings are recorded, which two threads cannot do at once
        offered: tuple[Callable[..., Any], ...] = (service.solve, service.certify, read, write)
        self._offered = {f"{PACKAGE}.{function.__name__}": function for function in offered}

    def handle_error(self, *_: object) -> None:
        """A connection that broke is not worth a word; ``Handler.log_message`` says why."""

    def _dispatch(self, method: str, params: tuple[Any, ...]) -> Any:
        """The answer to a call, as ``Proxy`` reads it; an error in one line."""
        if method in self.funcs:  # of COMPAS: ping, remote_shutdown
            return super()._dispatch(method, params)
        answer: dict[str, Any] = {"data": None, "error": None, "profile": None}
        with self._lock:
            try:
                answer["data"] = self._call(method, *params[:1])
            except Exception as error:  # the caller is in another process
                kind = "" if isinstance(error, PcmcError | MissingExtra) else f"{type(error).__name__}: "
                answer["error"] = " ".join(f"{kind}{error}".split())
            return json.dumps(answer, cls=DataEncoder)

    def _call(self, name: str, text: str = "") -> Any:
        if name not in self._offered:
            raise OptionError(unknown("function", name, self._offered), what="function", found=name)
        given, function = json.loads(text, cls=MeshDecoder), self._offered[name]
        try:
            inspect.signature(function).bind(*given["args"], **given["kwargs"])
        except TypeError as error:
            raise OptionError(f"{name}: {error}", what=name) from None
        return function(*given["args"], **given["kwargs"])


class MeshDecoder(DataDecoder):
    """Decodes meshes. Any other object stays a dict: COMPAS would import the module that it names."""

    def object_hook(self, o: dict[str, Any]) -> Any:
        if MESH not in [o.get("dtype"), *(o.get("inheritance") or ())]:
            return o
        try:
            return super().object_hook({**o, "dtype": MESH, "inheritance": None})
        except Exception as error:  # COMPAS checks little
            raise damaged_mesh(error) from None


def read(path: str, **options: Any) -> list[Any]:
    """The meshes of a file in the service's folder; options as in ``pcmc.read``."""
    return service.read(read_settings().place(path), **options)


def write(path: str, meshes: Any, weld: bool = False, overwrite: bool = False, **options: Any) -> None:
    """Write meshes to a file in the service's folder; an existing one only with ``overwrite``."""
    place = read_settings().place(path)
    check_regular(place)
    if not validate.flag("overwrite", overwrite) and place.exists():
        raise FileError(f"{path}: exists; pass overwrite=True to replace it", what=path)
    service.write(place, meshes, weld, **options)


def serve_calls(port: int | None = None) -> None:
    """Answer calls until Ctrl-C or ``Proxy.stop_server``; on the port of the settings unless one is given."""
    port = read_settings().port if port is None else port
    try:
        server = LoopbackServer(port)
    except (OSError, OverflowError) as error:
        text = f"port {port}: cannot be opened ({error}); end the program that has it, or remove"
        raise OptionError(f"{text} {settings_path()} and set up again", what="port", found=port) from None
    with closing(server.socket):
        server.serve_forever()
