"""Saving a page's surface as a project: the file's own text with other tensions, its comments kept."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..base.errors import FileError, MissingExtra, OptionError
from ..base.files import atomic_write
from ..design import Parameter, Target
from ..design.targets import measure
from ..project import load, project_text
from ..surface import Patch, Surface
from .roof import Roof, text_of

HELD = 1e-6  # relative misfit up to which a surface still meets a target
SAME = 1e-12  # relative difference of values that counts as none
FIELDS = ("quantity", "of", "value", "at_most", "at_least")


def save(
    roof: Roof,
    surface: Surface,
    name: str,
    replace: bool,
    aims: tuple[tuple[Target, ...], tuple[Parameter, ...]] | None = None,
) -> tuple[Path, str]:
    """Write a project with the tensions and pressures of a surface into the folder of its file.

    Parameters
    ----------
    roof : what the page opened.
    surface : the one to save.
    name : of the file, without folder.
    replace : whether a file of that name may be replaced.
    aims : targets met by the page, with what they vary.

    Returns
    -------
    (path, note) : the file, and what happened to its targets.

    Raises
    ------
    FileError
        For a name that leads elsewhere, a file that is there already, or was changed since it was read.
    OptionError
        For a surface whose values the project cannot hold.
    MissingExtra
        Without tomlkit.
    """
    path = _place(roof, name)
    text, note = project_with(roof, surface, aims)
    if path.exists():
        if not replace:
            text = f"{path.name} is there already; check that it may be replaced, or give another name"
            raise FileError(text, what="name", found=path.name)
        if roof.path is not None and path.resolve() == roof.path.resolve() and text_of(path) != roof.text:
            message = f"{path.name} was changed since the page read it; save under another name"
            raise FileError(message, what="name", found=path.name)
    with atomic_write(path) as temporary:
        temporary.write_bytes(text.encode())
        try:
            load(temporary)
        except FileError as error:
            message = str(error).replace(str(temporary), path.name)
            raise FileError(f"{message}; nothing is saved", what="name") from None
    return path, note


def _place(roof: Roof, name: str) -> Path:
    """The path of a file beside the roof's; FileError for one that is elsewhere."""
    if roof.path is None or not roof.is_project:
        raise FileError("only a project or a drawing can be saved as a project; use Export", what="name")
    name = name if name.lower().endswith(".toml") else f"{name}.toml"
    folder = roof.path.parent.resolve()
    plain = re.fullmatch(r"[^/\\:*?\"<>|.][^/\\:*?\"<>|]{0,100}", name) and name.isprintable()
    if not plain or (folder / name).resolve().parent != folder:
        text = f"{name!r:.60}: a name without folder is needed, such as variant.toml"
        raise FileError(text, what="name", found=name[:60])
    if (folder / name).exists() and not (folder / name).is_file():
        raise FileError(f"{name} is no file; give another name", what="name", found=name)
    return roof.path.parent / name


def project_with(
    roof: Roof, surface: Surface, aims: tuple[tuple[Target, ...], tuple[Parameter, ...]] | None = None
) -> tuple[str, str]:
    """The text of a roof's project with the values of a surface, and a note on its targets."""
    try:
        import tomlkit
    except ModuleNotFoundError:
        raise MissingExtra("tomlkit", "cad") from None
    assert roof.path is not None
    text = roof.text or project_text(roof.path, refer=True)[0]
    document = tomlkit.parse(text)
    before = {patch.name: patch for patch in roof.surface.patches}
    plan: Any = document["plan"]
    for patch, wall in zip(surface.patches, surface.walls.tolist(), strict=True):
        old = before.get(patch.name)
        if old is not None and wall:
            _set_wall(tomlkit, plan, patch, old, surface)
        elif old is not None:
            _set_patch(tomlkit, plan, patch, old)
    note = _set_targets(tomlkit, document, roof, surface, aims)
    return tomlkit.dumps(document), note


def _set_patch(tomlkit: Any, plan: Any, patch: Patch, old: Patch) -> None:
    """Tension and pressure of a patch under pressure."""
    patches = plan.setdefault("patches", tomlkit.table())
    if patch.name not in patches:
        patches[patch.name] = tomlkit.inline_table()
    for key, default in (("tension", None), ("pressure", 1.0)):
        value = getattr(patch, key)
        if key in patches[patch.name] or value != default:
            _put(patches[patch.name], key, value)


def _set_wall(tomlkit: Any, plan: Any, patch: Patch, old: Patch, surface: Surface) -> None:
    """The tension of a wall: of its divider, by the name or the number that it has in the plan."""
    if _same(patch.tension, old.tension):
        return
    dividers = plan.setdefault("dividers", tomlkit.aot())
    names = [_name(entry, k) for k, entry in enumerate(dividers, start=1)]
    short = re.sub(r"-\d+$", "", patch.name)
    name = patch.name if patch.name in names else short
    parts = [p for p in surface.patches if re.fullmatch(re.escape(name) + r"-\d+", p.name)]
    if any(not _same(p.tension, patch.tension) for p in parts):
        text = f"{name}: the parts of one divider have one tension in a project; give them the same"
        raise OptionError(text, what="tension", where=patch.name)
    if name not in names:
        entry = tomlkit.table()
        entry["name"] = patch.name
        dividers.append(entry)
        names.append(name)
    place = names.index(name)
    if not isinstance(dividers[place], Mapping):
        table = tomlkit.inline_table()
        table["curve"] = dividers[place]
        dividers[place] = table
    _put(dividers[place], "wall", patch.tension)


def _name(entry: Any, number: int) -> str:
    named = entry.get("name") if isinstance(entry, Mapping) else None
    return str(named) if named else f"wall {number}"


def _put(table: Any, key: str, value: float) -> None:
    """Set a number unless it is there already, so that its text stays."""
    old = table.get(key)
    if not isinstance(old, int | float) or not _same(float(old), value):
        table[key] = float(f"{value:.12g}")


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME * max(abs(one), abs(other))


def _set_targets(
    tomlkit: Any,
    document: Any,
    roof: Roof,
    surface: Surface,
    aims: tuple[tuple[Target, ...], tuple[Parameter, ...]] | None,
) -> str:
    """Keep the targets that the surface meets: those of the page, else those of the file.

    Others become comments: with them, solving the project would lead away from the surface saved.
    """
    if aims is not None and _meets(surface, aims[0]):
        table = tomlkit.table()
        points = document["plan"].get("points", {})
        table["meet"] = _array(tomlkit, [_target(t, points) for t in aims[0]])
        table["vary"] = _array(tomlkit, [_plain(p) for p in aims[1]])
        document["targets"] = table
        return f"with its targets: {', '.join(t.label for t in aims[0])}"
    if not roof.targets or _meets(surface, roof.targets):
        return ""
    labels = ", ".join(t.label for t in roof.targets if not _meets(surface, (t,)))
    if "targets" in document:
        kept = tomlkit.dumps({"targets": document["targets"]}).strip()
        del document["targets"]
        document.add(tomlkit.nl())
        for line in ("not met by the tensions saved here:", *kept.splitlines()):
            document.add(tomlkit.comment(line))
        return f"its [targets] as comments, as the surface saved does not meet them ({labels})"
    text = f"the drawing asks for {labels}, and the surface shown does not meet it; change the drawing"
    raise OptionError(text, what="targets")


def _meets(surface: Surface, targets: tuple[Target, ...]) -> bool:
    values = [measure(surface, target).value for target in targets]
    return all(
        abs(value - t.nearest(value)) <= HELD * t.scale(surface)
        for t, value in zip(targets, values, strict=True)
    )


def _target(target: Target, points: Mapping[str, Any]) -> dict[str, Any]:
    """A target as in a project: a point that the plan names by its name."""
    entry = {key: getattr(target, key) for key in FIELDS}
    return entry | {"of": target.name} if target.name in points else entry


def _plain(parameter: Parameter) -> Any:
    """A parameter as in a project: its name, a list of names, or a table."""
    names = list(parameter.names) if len(parameter.names) > 1 else parameter.names[0]
    return names if _bare(parameter) else {**vars(parameter), "patch": names}


def _bare(parameter: Parameter) -> bool:
    """Whether a project can name a parameter by its patch alone."""
    return parameter.kind == "tension" and (parameter.low, parameter.high) == (None, None)


def _array(tomlkit: Any, values: Sequence[Any]) -> Any:
    """A list of names and tables, each table in one line and without empty values."""
    array = tomlkit.array()
    for value in values:
        if isinstance(value, Mapping):
            table = tomlkit.inline_table()
            table.update(
                {k: list(v) if isinstance(v, tuple) else v for k, v in value.items() if v is not None}
            )
            array.append(table)
        else:
            array.append(list(value) if isinstance(value, tuple) else value)
    return array
