"""Roofs solved before, so that the next command need not solve them again.

A file for each project in the user's cache folder, named after a hash of all that the roof depends on: the
plan with the drawings that it was read from, or the mesh as it was read, the solver, the remeshing, the
targets, the version of pcmc.
The environment variable ``PCMC_CACHE`` names another folder; ``PCMC_CACHE=off`` keeps nothing.
"""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .. import io
from ..base.errors import FileError, LostWarning, PcmcError
from ..base.files import atomic_write
from ..design import Design, DesignStatus
from ..io.mesh_data import to_surface
from ..solvers.result import Result, Status
from ..surface.surface import FIELDS
from .file import Project
from .outcome import Outcome

MOST = 100  # roofs kept; the one used longest ago goes first
OWN = "[0-9a-f]" * 64 + ".pcmc"  # its files: the folder that ``PCMC_CACHE`` names may have others
PARTS = ["plan", "mesh", "method", "options", "wanted", "search"]
PARTS += ["remeshing", "targets", "vary", "target_tolerance"]
NUMBERS = ("method", "energy", "iterations", "evaluations", "note")  # of a result


def cache_folder() -> Path | None:
    """The folder of the cache, which may not exist yet; None if it is switched off."""
    given = os.environ.get("PCMC_CACHE", "")
    if given.lower() == "off":
        return None
    if given:
        return Path(given)
    from platformdirs import user_cache_path

    return user_cache_path("pcmc") / "roofs"


def cached_files() -> list[Path]:
    """The files of the cache, the one used longest ago first."""
    place = cache_folder()
    with suppress(OSError):
        return sorted(place.glob(OWN), key=lambda path: path.stat().st_mtime_ns) if place else []
    return []


def clear_cache() -> list[Path]:
    """Remove all files of the cache; return those removed."""
    removed = []
    for path in cached_files():
        with suppress(OSError):
            path.unlink()
            removed.append(path)
    return removed


def cached(path: Path | None) -> Outcome | None:
    """The designed roof in a file of the cache, if it was solved before; without its project and units. A
    damaged file counts as none."""
    if path is None or not path.is_file():
        return None
    with suppress(PcmcError, OSError, KeyError, ValueError, TypeError):
        data = io.load(path)
        values, design = data.certificate, None
        solve = {name: values[name] for name in NUMBERS}
        result = Result(to_surface(data), Status[values["status"]], rows=(), **solve)
        if given := values.get("design"):
            targets, parameters = (pd.DataFrame(**given[name]) for name in ("targets", "parameters"))
            status, history = DesignStatus[given["status"]], pd.DataFrame()
            design = Design(status, result, targets, parameters, given["solves"], history=history)
        outcome = Outcome(result, design=design, cached=True, notes=values.get("notes", ()))
        os.utime(path)
        return outcome
    return None


def keep(path: Path | None, outcome: Outcome) -> None:
    """Put a designed roof into the cache, if it is good. A cache that cannot be written is left alone."""
    if path is None or not outcome.good:
        return
    result, design, surface = outcome.solved, outcome.design, outcome.surface
    values: dict[str, Any] = {name: getattr(result, name) for name in NUMBERS}
    values |= {"status": result.status.name, "notes": list(outcome.notes)}
    if design is not None:
        tables = {name: getattr(design, name).to_dict("split") for name in ("targets", "parameters")}
        values["design"] = {"status": design.status.name, "solves": design.solves, **tables}
    with suppress(OSError, PcmcError, LostWarning), warnings.catch_warnings():
        warnings.simplefilter("error", LostWarning)  # a surface that the file cannot hold is not kept
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_write(path) as temporary:
            io.write(temporary, surface, certificate=values)
            back = to_surface(io.load(temporary))
            if any(plain_bytes(getattr(surface, f)) != plain_bytes(getattr(back, f)) for f in FIELDS):
                raise FileError("the file does not hold all of the surface")
        for old in cached_files()[:-MOST]:
            old.unlink(missing_ok=True)


def path_for(project: Project, mesh: Outcome | None) -> Path | None:
    """The file for a project and its mesh, as that was read: its files may have changed since. None for a
    project that is not kept."""
    place = cache_folder()
    if place is None or not project.specified:
        return None
    sha = hashlib.sha256(_program().encode())
    try:
        sha.update(plain_bytes([getattr(project, name) for name in PARTS]))
        if mesh is not None:
            sha.update(plain_bytes([mesh.units, *(getattr(mesh.surface, name) for name in FIELDS)]))
    except TypeError:  # a value without a text of its own
        return None
    return place / f"{sha.hexdigest()}.pcmc"


@cache
def _program() -> str:
    newest = max(path.stat().st_mtime_ns for path in Path(__file__).parents[1].rglob("*.py"))
    return f"pcmc {version('pcmc-surfaces')} {newest}\n"


def plain_bytes(value: Any) -> bytes:
    """The same for equal values and others for others; TypeError for a value of unknown kind."""
    return json.dumps(value, default=_plain, sort_keys=True).encode()


def _plain(value: Any) -> Any:
    """Plain data that stand for a value which JSON has no form for."""
    if is_dataclass(value) and not isinstance(value, type):
        return {type(value).__qualname__: {f.name: getattr(value, f.name) for f in fields(value)}}
    if isinstance(value, np.ndarray) and value.dtype != object:
        return [value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"no bytes for {type(value).__name__}")
