"""The roof behind a page: how its file was read, the watch of that file, and saving it as a project."""

from __future__ import annotations

import dataclasses
import os
import re
import threading
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast

from .. import project as projects
from ..accuracy import MeshCheck
from ..base.errors import FileError, MissingExtra, OptionError, PcmcError
from ..base.files import PathLike, atomic_write
from ..base.libraries import load_library
from ..base.units import NO_UNITS, Units
from ..design import Parameter, Target
from ..design.targets import measure
from ..project import Project, surface_of
from ..project.drawn import files_of
from ..project.file import project_of, read_data
from ..project.planning import project_text
from ..project.settings import LISTS, SINGLE
from ..project.values import data_with_values, differences
from ..surface import Surface

EVERY = 0.5  # seconds between two looks at the files
Signature = tuple[tuple[str, tuple[int, ...]], ...]
Targets = tuple[Target, ...]
Varied = tuple[Parameter, ...]  # what may vary for targets
Aims = tuple[Targets, Varied]


@dataclass(frozen=True, eq=False)
class ShownRoof:
    """What a page opens."""

    outcome: projects.Outcome  # of a project, of its start shape, or of a surface alone
    title: str = ""  # at the top of the page; downloads are named after it
    signature: Signature = ()  # of the file and those it refers to, before they were read

    @classmethod
    def of(cls, surface: Surface, title: str = "", units: Units = NO_UNITS) -> ShownRoof:
        """A surface from a program.

        >>> ShownRoof.of(None, "halls/nave & apse").name, ShownRoof.of(None).name
        ('halls-nave & apse', 'surface')
        """
        return cls(projects.Outcome.of(surface, units), title)

    @property
    def surface(self) -> Surface:
        """The designed roof of a project, its start shape, or any other surface."""
        return self.outcome.surface

    @property
    def project(self) -> projects.Project | None:
        """The project behind it, also of a drawing; None for any other file, and a surface from a program."""
        project = self.outcome.project
        return project if project is not None and project.specified else None

    @property
    def path(self) -> Path | None:
        return None if self.outcome.project is None else self.outcome.project.path

    @property
    def aims(self) -> Aims:
        """The targets of its project, and what may vary for them."""
        project = self.project
        return ((), ()) if project is None else (tuple(project.targets), tuple(project.vary))

    def meets(self, surface: Surface, targets: Sequence[Target]) -> bool:
        """Whether a surface meets targets, to the project's tolerance where it is a wider one."""
        most = max(HELD, (self.project and self.project.target_tolerance) or 0.0)
        values = [(target, measure(surface, target).value) for target in targets]
        return all(abs(value - t.nearest(value)) <= most * t.scale(surface) for t, value in values)

    def found(self, aims: Aims) -> set[tuple[str, str]]:
        """The values, each by kind and name, that a search for targets finds."""
        return {(f"{parameter.kind}s", name) for parameter in aims[1] for name in parameter.names}

    def advised(self, check: MeshCheck, progress: Callable[[str], None]) -> MeshCheck:
        """A mesh check with what to type, of ``projects.firmer``, if the project has the values checked."""
        surface, project = check.surfaces[0], self.project
        if check.advice or project is None or project.plan is None:
            return check
        own = surface is self.surface or self.meets(surface, self.aims[0])
        if not own or differences(surface_of(project), surface, self.found(self.aims)):
            save = "save the roof shown as a project: pcmc solve looks for a change of it that persists"
            held = check.verdict.name == "HELD_BY_MESH"  # for other verdicts none is looked for
            return dataclasses.replace(check, advice=save) if held else check
        known = {(self.outcome.unfold, "mesh check"): check}
        outcome = dataclasses.replace(self.outcome, result=None, start=surface, _known=known)
        projects.firmer(outcome, None, progress)
        return cast(MeshCheck, outcome.mesh_check)

    @cached_property
    def note(self) -> str:
        """How the project ended, in one sentence; empty where that needs no words."""
        outcome, certificate = self.outcome, self.outcome.certificate
        if outcome.result is None:
            return "the targets are not met yet: the page opened its start shape" if self.aims[0] else ""
        note = "" if outcome.design is None else outcome.design.text(outcome.units)
        if not certificate.certified:
            note = "; ".join(filter(None, (note, certificate.verdict.value, certificate.detail)))
        return note

    @property
    def good(self) -> bool:
        """Whether the project has a roof to show; if not, ``note`` says why."""
        return self.outcome.result is None or self.outcome.certificate.index is not None

    @property
    def name(self) -> str:
        """The name of downloads, without suffix."""
        name = self.outcome.name or self.title
        kept = "".join("-" if c in '\\/:*?"<>|' or not c.isprintable() else c for c in name)
        return kept.strip(" .")[:80] or "surface"


def read_roof(
    path: PathLike,
    *,
    start_shape: bool = False,
    use_cache: bool = True,
    progress: Callable[[str], None] | None = None,
    report: Callable[[projects.Outcome], None] | None = None,
) -> ShownRoof:
    """The roof in a file, as ``pcmc.project.opened``: of a project the designed one, its targets met.

    ``start_shape`` shows the shape before it is solved; ``progress`` is called with a few words at each step,
    ``report`` with the outcome of a project. Errors as ``pcmc.project.opened``.
    """
    path = Path(path)
    before = signature(path)
    outcome = projects.opened(path, progress, start=start_shape, use_cache=use_cache)
    if report is not None and outcome.result is not None:
        report(outcome)
    return ShownRoof(outcome, path.name, before)


def signature(path: Path) -> Signature:
    """What tells that a file, or one that it refers to, was saved, replaced, or can no longer be read."""
    states: list[tuple[str, tuple[int, ...]]] = []
    for file in files_of(path):
        seen: tuple[int, ...] = ()
        with suppress(OSError, ValueError):  # missing, or no name of a file
            state, readable = file.stat(), os.access(file, os.R_OK)
            seen = (state.st_mtime_ns, state.st_size, state.st_mode, state.st_ino, readable)
        states.append((str(file), seen))
    return tuple(states)


class Watch:
    """A thread that reads a roof again whenever its files change."""

    def __init__(
        self, path: Path, seen: Signature, read: Callable[[], ShownRoof], show: Callable[[ShownRoof], None]
    ):
        self.path, self.seen = path, seen
        self._read, self._show = read, show
        self.problem = ""  # why the newest save has no roof, in one line
        self.working = False  # whether the roof of a save is being computed
        self._end = threading.Event()
        threading.Thread(target=self._run, daemon=True).start()

    def close(self) -> None:
        self._end.set()

    def _run(self) -> None:
        last = self.seen
        while not self._end.wait(EVERY):
            now = signature(self.path)
            if now != self.seen and now == last:  # saved, and no longer being written
                self.seen = now
                self._follow()
            last = now

    def _follow(self) -> None:
        self.working = True
        try:
            roof = self._read()
            if roof.good:
                self._show(roof)
            self.problem = "" if roof.good else roof.note
        except (PcmcError, MissingExtra, OSError) as error:
            self.problem = " ".join(str(error).replace(f"{self.path}: ", "").split())
        except Exception as error:  # the net: the page must learn that its shape is an old one
            self.problem = " ".join(f"{type(error).__name__}: {error}".split())
        finally:
            self.working = False


HELD = 1e-6  # relative misfit up to which a surface still meets a target
FIELDS = ("quantity", "of", "value", "at_most", "at_least")


def save(
    roof: ShownRoof, surface: Surface, name: str, replace: bool, aims: Aims | None = None
) -> tuple[Path, str]:
    """Write a project with the values of a surface into the folder of its file.

    ``name`` is that of the file, without folder; with ``replace`` it may be that of a project that is there.
    ``aims`` are targets met by the page, with what they vary. Returns the file, and what happened to its
    targets. FileError for a name that leads elsewhere, or a file that may not be replaced; OptionError for
    values that the project cannot hold; MissingExtra without tomlkit.
    """
    project, path = _place(roof, name, replace)
    text, note, left = project_with(roof, surface, aims, path.stem)
    with atomic_write(path) as temporary:
        ends = "\r\n" if project.path.exists() and b"\r\n" in project.path.read_bytes() else "\n"
        temporary.write_text(text, encoding="utf-8", newline=ends)
        try:  # read back: the file, not what it was made from, is what counts
            saved = surface_of(project_of(temporary, read_data(temporary)[1]))
        except FileError as error:
            message = str(error).replace(str(temporary), path.name)
            raise FileError(f"{message}; nothing is saved", what="name") from None
        wrong = [f"{kind.removesuffix('s')} of {name}" for kind, name in differences(saved, surface, left)]
        if wrong:
            message = f"{path.name} would have another {', '.join(wrong[:5])}; nothing is saved"
            raise OptionError(message, what="values", found=wrong)
    return path, note


def _place(roof: ShownRoof, name: str, replace: bool) -> tuple[Project, Path]:
    """The roof's project, and the path of a file beside its; FileError for one that is elsewhere, or may not
    be replaced."""
    project, name, problem = roof.project, name.strip(), ""
    if project is None:
        raise FileError("only a project or a drawing can be saved as a project; use Export", what="name")
    name = name if name.lower().endswith(".toml") else f"{name}.toml"
    path, folder = project.path.parent / name, project.path.parent.resolve()
    if not re.fullmatch(r"[^/\\:*?\"<>|.][^/\\:*?\"<>|]*", name) or not name.isprintable():
        problem = "a name without folder is needed, such as variant.toml"
    elif len(name) > 100 or len(name.encode()) > 240:  # file systems have 255 bytes
        problem = "a shorter name is needed: at most 100 letters and 240 bytes, with .toml"
    elif path.resolve().parent != folder:
        problem = "this is a link to another folder; give another name"
    elif path.exists() and not path.is_file():
        problem = "this is no file; give another name"
    elif path.exists() and not replace:
        problem = "this is there already; check that it may be replaced, or give another name"
    elif path.exists() and path.resolve() == project.path.resolve():
        if path.read_text(encoding="utf-8-sig") != project.text:
            problem = "this was changed since the page read it; save under another name"
    elif path.exists():
        try:
            read_data(path)
        except FileError:
            problem = "this is no project of pcmc, so it is not replaced; give another name"
    if problem:
        raise FileError(f"{name!r:.60}: {problem}", what="name", found=name[:60])
    return project, path


def project_with(
    roof: ShownRoof, surface: Surface, aims: Aims | None = None, stem: str = ""
) -> tuple[str, str, set[tuple[str, str]]]:
    """The text of a roof's project with the values of a surface, a note on its targets, and what these find.

    Targets that the surface meets are kept: those of the page, else those of the file. Others become comments
    or, for a rise, the tension: with them, solving the project would lead away from the surface saved. With
    ``stem``, the name of the new file, the output gets other names, too.
    """
    tomlkit = load_library("tomlkit", "cad")
    project = roof.project
    assert project is not None
    text = project.text or project_text(project.path, refer=True)[0]
    document, data = tomlkit.parse(text), tomllib.loads(text)
    given, note, dropped, found = data.get("targets"), "", "", {}
    kept: Aims = roof.aims
    if aims is not None and aims != kept and roof.meets(surface, aims[0]):
        kept, points = aims, data["plan"].get("points", {})
        entries = [_target(target, points) for target in aims[0]]
        found = {"meet": entries, "vary": [p.plain for p in aims[1]]}
        data.pop("targets", None)  # until a rise that these replace is a tension
        note = f"with its targets: {', '.join(t.label for t in aims[0])}"
    elif not roof.meets(surface, roof.aims[0]):
        kept = (), ()
        labels = ", ".join(t.label for t in roof.aims[0] if not roof.meets(surface, (t,)))
        if given is not None:
            del data["targets"]
            dropped = tomlkit.dumps({"targets": document["targets"]}).strip()
            note = f"its [targets] as comments, as the surface saved does not meet them ({labels})"
        elif project.drawing is not None and len(project.drawing.heights):
            problem = f"the drawing asks for {labels}, and the surface shown does not meet it"
            raise OptionError(f"{problem}; change the drawing", what="targets")
        else:
            note = f"with tensions instead of heights that the surface saved does not have ({labels})"
    left = roof.found(kept) - differences(roof.surface, surface).keys() if kept == roof.aims else set()
    data = data_with_values(project.path, data, surface, left)[0] | ({"targets": found} if found else {})
    old = project.path.stem
    if stem and stem != old:
        output: dict[str, Any] = data.get("output", {})
        for key in output.keys() & {*LISTS, *SINGLE}:
            given_one = isinstance(names := output[key], str)
            output[key] = _renamed(names, old, stem) if given_one else [_renamed(n, old, stem) for n in names]
    if found and given is None:
        document["targets"] = tomlkit.table()
        for key, entries in found.items():
            document["targets"][key] = tomlkit.array()
            document["targets"][key].extend(_item(tomlkit, entry) for entry in entries)
    _change(tomlkit, document, data)
    if dropped:
        document.add(tomlkit.nl())
        for line in ("not met by the values saved here:", *dropped.splitlines()):
            document.add(tomlkit.comment(line))
    return tomlkit.dumps(document), note, left


def _renamed(name: str, old: str, new: str) -> str:
    """The name of an output of the project ``new``, from that of ``old``.

    >>> _renamed("out/roof-plan.dxf", "roof", "higher"), _renamed("all.glb", "roof", "higher")
    ('out/higher-plan.dxf', 'higher-all.glb')
    """
    path = Path(name)
    rest = path.name.removeprefix(old) if path.name.startswith(old) else f"-{path.name}"
    return path.with_name(new + rest).as_posix()


def _target(target: Target, points: Mapping[str, Any]) -> dict[str, Any]:
    """A target as in a project: a point that the plan names by its name."""
    entry = {key: getattr(target, key) for key in FIELDS}
    entry |= {"of": target.name} if target.name in points else {}
    return {k: list(v) if isinstance(v, tuple) else v for k, v in entry.items() if v is not None}


def _change(tomlkit: Any, table: Any, data: Mapping[str, Any]) -> None:
    """Give a table of a document the values of ``data``; where nothing differs, the text stays."""
    for key in [key for key in table if key not in data]:
        del table[key]
    for key, value in data.items():
        if key in table:
            _change_item(tomlkit, table, key, value)
        else:
            table[key] = _item(tomlkit, value)


def _change_item(tomlkit: Any, table: Any, key: Any, value: Any) -> None:
    """Give an entry of a table or a list another value."""
    old = table[key]
    if isinstance(value, Mapping) and isinstance(old, Mapping):
        _change(tomlkit, old, value)
    elif isinstance(value, list) and isinstance(old, list) and len(value) >= len(old) > 0:
        for place in range(len(old)):
            _change_item(tomlkit, old, place, value[place])
        for more in value[len(old) :]:
            old.append(more if isinstance(old, tomlkit.items.AoT) else _item(tomlkit, more))
    elif old != value:
        table[key] = _item(tomlkit, value)


def _item(tomlkit: Any, value: Any) -> Any:
    """Plain data for a document: a table of plain values in one line."""
    if isinstance(value, Mapping) and not any(isinstance(v, Mapping) for v in value.values()):
        item = tomlkit.inline_table()
        item.update(value)
        return item
    return value
