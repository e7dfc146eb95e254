"""The explorer behind the page: a session for each page, and the answers to its requests."""

from __future__ import annotations

import dataclasses
import secrets
import tempfile
import threading
from collections import OrderedDict
from collections.abc import Callable
from http import HTTPStatus
from pathlib import Path
from typing import Any

from ..base.errors import SurfaceError, unknown
from ..drawings.sheet import MISSED
from ..io import FORMATS
from ..project import load
from ..project.members import filed_besides, has_members, members_drawn
from ..project.writing import certified_files
from ..surface import Surface
from ..surface.images import expect_no_images
from . import page_data
from .following import ProjectFallback, Stop
from .listening import ACTS, LOOPBACK, REQUESTS, PageHandler, RequestError, check_request, listen, pack
from .roof import ShownRoof, Watch, save, signature
from .session import Session, SessionState, Turn, solved_start

LEFT_OUT = "members are left out: they are known for a part of the roof alone"
MOST_SESSIONS = 32  # more pages than this end the least recently used session
SOLVES_AT_ONCE = 2
POLL = 0.1  # seconds after which the server sees that it shall end
Answer = tuple[dict[str, Any], page_data.Arrays]  # header and arrays; see listening.py


class Explorer:
    """A running server: the page's ``url``, and ``sessions``, one for each page, the last used at the end."""

    def __init__(
        self, roof: ShownRoof, host: str, port: int, watch: Callable[[], ShownRoof] | None = None
    ) -> None:
        if not isinstance(roof.surface, Surface):
            found = type(roof.surface).__name__
            raise SurfaceError(f"explore: expected a Surface, found {found}", what="surface", found=found)
        expect_no_images(roof.surface, "explore")
        self._server = listen(host, port, PageHandler)
        self._server.explorer = self
        self.local = host in LOOPBACK
        self.roof, self.origin = roof, page_data.centre(roof.surface)
        self.start = solved_start(roof.surface)
        self.version = 0
        self.sessions: OrderedDict[str, Session] = OrderedDict()
        self.token = secrets.token_urlsafe(16)
        self._turn, self._checks = threading.Semaphore(SOLVES_AT_ONCE), threading.Semaphore(1)
        self._lock, self._saving = threading.Lock(), threading.Lock()
        self.port = int(self._server.server_address[1])
        named = "127.0.0.1" if host in ("", "0.0.0.0") else f"[{host}]" if ":" in host else host
        self.url = f"http://{named}:{self.port}/?token={self.token}"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(POLL,), daemon=True)
        self._thread.start()
        self.watch: Watch | None = None
        if watch is not None and roof.path is not None:
            self.watch = Watch(roof.path, roof.signature, watch, self.show)

    def show(self, roof: ShownRoof) -> None:
        """Show another roof on every page."""
        start = solved_start(roof.surface)
        if start.failure is not None:
            raise SurfaceError(f"{start.failure.verdict.value}; {start.failure.detail}", what="surface")
        with self._lock:
            self.roof, self.origin, self.start = roof, page_data.centre(roof.surface), start
            sessions = list(self.sessions.values())
        for session in sessions:
            session.renew(start, roof.outcome.units, self._fallback())
        self.version += 1

    def _fallback(self) -> ProjectFallback:
        project = self.roof.project
        return ProjectFallback() if project is None else ProjectFallback(project.path, project.data)

    def open(self) -> tuple[str, Session]:
        """The name of a new session, and the session."""
        name, units = secrets.token_urlsafe(12), self.roof.outcome.units
        session = Session(self.start, self._turn, units, self._fallback(), self._checks)
        with self._lock:
            self.sessions[name] = session
            while len(self.sessions) > MOST_SESSIONS:
                self.sessions.popitem(last=False)
        return name, session

    def session(self, name: str) -> Session:
        with self._lock:
            if name not in self.sessions:
                raise RequestError("this session has expired; reload the page", HTTPStatus.GONE)
            self.sessions.move_to_end(name)
            return self.sessions[name]

    def answer(
        self, name: str, act: str, asked: dict[str, Any], gone: Stop, turn: Turn | None = None
    ) -> bytes:
        """Answer a request of the session ``name``; ``gone`` is true once the browser has hung up."""
        if act == "open":
            name = check_request(REQUESTS[act], asked).get("session") or self.open()[0]
            return pack(*self._opening(name, self.session(name).state()))
        session = self.session(name)
        given = check_request(REQUESTS[act], asked)
        if act not in ACTS:
            return pack(*(self._question(session, act, given, gone) or ({"superseded": True},)))
        values = (given,) if act in ("follow", "settle") else ()
        options = {} if values else given | ({"gone": gone} if act == "meet" else {})
        state = getattr(session, act)(*values, turn=turn, **options)
        if state.superseded:  # newer values have arrived meanwhile
            return pack({"superseded": True})
        about, arrays = self._shown(state, moving=act == "follow")
        return pack({"superseded": False, **about}, arrays)

    def _question(self, session: Session, act: str, given: dict[str, Any], gone: Stop) -> Answer | None:
        """What is asked about the surface shown; None if the page shows another one before it is found."""
        units = self.roof.outcome.units
        match act:
            case "check":
                check = session.check_mesh(gone, self.roof.advised)
                return None if check is None else ({"check": page_data.mesh_findings(check, units)}, {})
            case "margin":
                margin = session.margin(**given, gone=gone)
                if margin is None:
                    return None
                there = page_data.drawn(margin.surface).vertices - self.origin
                return {"margin": margin.text(units)}, {"vertices": there}
            case "equilibria":
                found = session.equilibria(**given, gone=gone)
                return None if found is None else (page_data.equilibria_data(found, units), {})
            case "verify":
                theorem = session.verify()
                return {"badge": theorem.brief(units), "text": theorem.text(units)}, {}
            case "families":
                return {}, {"family": page_data.families_drawn(session.state())}
            case "news":
                watch = self.watch
                news = {"working": bool(watch and watch.working), "problem": watch.problem if watch else ""}
                return {"version": self.version, "progress": session.progress, **news}, {}
        return self.save(session, **given), {}

    def _opening(self, name: str, state: SessionState) -> Answer:
        """A state with what the page learns once: the mesh, the file and what may be asked."""
        roof, origin = self.roof, self.origin
        about, arrays = page_data.outline(state.surface, origin)
        header, fields = self._shown(state)
        left_out = LEFT_OUT if has_members(roof.outcome) and "member_ends" not in fields else ""
        untouched = state.surface is self.start.surface  # the note is about the start
        targets, vary = state.aims or roof.aims
        aims = {"targets": [{**vars(target), "label": target.label} for target in targets]}
        aims["vary"] = [{"label": parameter.label, "parameter": vars(parameter)} for parameter in vary]
        once = {
            "session": name,
            "formats": list(FORMATS),
            "title": roof.title,
            "name": roof.name,
            "whole_files": roof.outcome.unfold,
            "units": page_data.unit_texts(roof.outcome.units),
            "note": "; ".join(filter(None, (roof.note if untouched else "", left_out))),
            "note_met": untouched and roof.outcome.result is not None and roof.outcome.good,
            "project": roof.project is not None and self.local,
            "file": roof.path.name if roof.path is not None else "",
            "quantities": page_data.target_choices(state.surface),
            "aims": aims,
            "watching": self.watch is not None,
            "version": self.version,
            "superseded": False,
        }
        return about | once | header, arrays | fields

    def _shown(self, state: SessionState, moving: bool = False) -> Answer:
        """A state, with the members of the project where its values do not move."""
        about, arrays = page_data.state_data(state, self.origin, moving), page_data.fields(state, self.origin)
        outcome = self.roof.outcome
        if not moving and has_members(outcome) and page_data.whole_of(state.surface) is None:
            members = members_drawn(outcome, state.surface, state.certificate)
            rows, ends = page_data.members_data(members, self.origin)
            about["figures"] += rows
            arrays |= ends
        return about, arrays

    def save(self, session: Session, name: str, replace: bool = False) -> dict[str, Any]:
        """Save the surface of a session as a project beside the file that was opened."""
        if not self.local:
            text = "only a page of this machine saves files; this server listens for others, too"
            raise RequestError(text, HTTPStatus.FORBIDDEN)
        start, state = self.start, session.state()  # after all that was asked for before
        with self._saving:
            if self.start is not start:
                raise RequestError("the file was changed while this save waited; save again")
            path, note = save(self.roof, state.surface, name, replace, state.aims)
            if path == self.roof.path:
                outcome = dataclasses.replace(self.roof.outcome, project=load(path))
                self.roof = dataclasses.replace(self.roof, outcome=outcome)
                if self.watch is not None:  # the page shows this already
                    self.watch.seen = signature(path)
        return {"saved": path.name, "note": note}

    def export(self, session: str, suffix: str) -> tuple[str, bytes, str]:
        """The name and the content of a file with the surface of a session, and what the format loses."""
        state, roof = self.session(session).state(), self.roof
        if suffix not in FORMATS:
            raise RequestError(unknown("format", suffix[:60], FORMATS))
        known = {(False, "certificate"): state.certificate}
        outcome = dataclasses.replace(roof.outcome, result=None, start=state.surface, data=None, _known=known)
        besides = filed_besides(outcome) if FORMATS[suffix].besides else {}
        targets, _ = state.aims or roof.aims
        mark, notes = "" if roof.meets(state.surface, targets) else MISSED, list[str]()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"surface{suffix}"
            for file, write in certified_files(*outcome.shown, [path], outcome.units, "", besides, mark):
                write(file, notes=notes)
            return f"{roof.name}{suffix}", path.read_bytes(), "; ".join(notes)

    def wait(self) -> None:
        """Return when the server is closed."""
        while self._thread.is_alive():
            self._thread.join(0.5)

    def close(self) -> None:
        """Stop listening."""
        if self.watch is not None:
            self.watch.close()
        self._server.shutdown()
        self._server.server_close()
        self._server.close_connections()
        self._thread.join()


class View:
    """The page in a notebook: its ``url``, to open it in a window; ``close()`` ends the server behind it."""

    def __init__(self, roof: ShownRoof, height: int) -> None:
        self.explorer = Explorer(roof, "127.0.0.1", 0)
        name, self._session = self.explorer.open()
        self.height, self.url = int(height), f"{self.explorer.url}&session={name}"
        self.close = self.explorer.close

    @property
    def surface(self) -> Surface:
        """The surface that the page shows now."""
        return self._session.surface

    def _repr_html_(self) -> str:
        return (
            f'<iframe src="{self.url}" width="100%" height="{self.height}" style="border:0"'
            ' allow="fullscreen" title="pcmc explore"></iframe>'
        )
