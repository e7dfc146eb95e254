"""Surfaces to files."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.arrays import Floats
from ..base.errors import FileError, FileWarning, LostWarning, PcmcError
from ..base.files import PathLike, as_path, atomic_write, check_name, writing
from ..base.units import Units, as_units, length_factor
from ..base.validate import checked_name, choice, one_line, refuse
from ..forces.pinching import standing_part
from ..surface import Surface, expect_surface
from ..surface.supports import part_of_roof
from .formats import FORMATS, Content, format_of
from .georeference import Georeference
from .mesh_data import scaled_surface
from .metadata import encode_walls, metadata_text

BESIDES = {"members": "members", "cable_areas": "sections of cables", "georeference": "its place on a map"}


def write(
    path: PathLike,
    surface: Surface | Any,
    *,
    scalars: Mapping[str, Floats] | None = None,
    certificate: object | None = None,
    colour: str = "",
    units: Units | str | None = None,
    members: Sequence[Any] = (),
    cable_areas: Mapping[str, float] | None = None,
    mark: str = "",
    georeference: Georeference | None = None,
    notes: list[str] | None = None,
) -> None:
    """Write a surface as the suffix says; the file appears whole or not at all.

    A wall below a junction on Π has triangles without area. Formats with a mesh per patch (.stl, .glb, .gltf,
    .3dm, .ifc, .usda) leave them out; all but .stl hold these walls as text, and ``read`` puts them back.
    From .stl, and if another program changed the surface, the junction comes back sliding on Π.

    Parameters
    ----------
    path : the file; ``pcmc.io.FORMATS`` lists the suffixes.
    surface : a Surface, or the result of a solver, whose certificate is then written, or of ``repair``.
    scalars : (n,) or (m,) arrays by name (curvature, error, ...), for formats that hold them.
    certificate : a Certificate, or values by name, for the formats that hold it (.pcmc, .ifc).
    colour : the (n,) scalar that colours the vertices (.glb, .gltf, .usda); else each patch has a colour.
    units : of the surface: a unit of length such as "mm", or ``pcmc.base.units.Units``; the file names them.
        To .glb and .gltf, which are in metres, the surface is converted (scalars are not). Without a unit the
        numbers stay, and .3dm, .ifc and .usda files are in metres.
    members : of its structural model, ``structure.drawn_members(model)``, for .ifc and .3dm.
    cable_areas : of the sections of its cables there, length², by name.
    mark : in the file where the certificate has none, such as "TARGETS NOT MET"; .stl has no place for one.
    georeference : its place on a map, for .ifc.
    notes : a list to which the texts of the warnings are added, instead of warning.

    Warns
    -----
    LostWarning : once, naming what the format cannot carry.
    FileWarning : if the coordinates are written relative to another origin (.stl).

    Examples
    --------
    >>> import tempfile
    >>> from pcmc import Patch, Surface, read
    >>> film = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [0], [Patch("film", 2.0)], fixed=[0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(folder + "/film.pcmc", film, units="m")
    ...     again = read(folder + "/film.pcmc")
    >>> again.patches == film.patches
    True
    """
    path = as_path(path)
    check_name(path)
    form, solved = format_of(path, FORMATS), surface
    surface = getattr(solved, "surface", solved)
    expect_surface(surface)
    known: Any = getattr(solved, "certificate", None) if certificate is None else certificate
    mark = (known.get("mark") if isinstance(known, Mapping) else getattr(known, "mark", "")) or mark
    one_line("mark", mark)
    if form.certificate:
        certificate = known
    if not isinstance(scalars, Mapping | None):
        refuse("scalars", scalars, "arrays by name, such as {'height': [...]}")
    scalars = {name: _scalar(surface, name, value) for name, value in (scalars or {}).items()}
    if not isinstance(georeference, Georeference | None):
        refuse("georeference", georeference, "a Georeference or None")
    units = as_units("" if units is None else units)
    carried = form.carried(surface, scalars)
    lost = [name for name in scalars if name not in carried]
    if colour:
        choice("colour", colour, [name for name, scalar in scalars.items() if len(scalar) == surface.n])
        if not form.colours:
            lost.append(f"colours of {colour!r}")
    if certificate not in (None, {"mark": mark}) and not form.certificate:
        lost.append("certificate")
    lost += form.lost(surface, units)
    besides = {"members": members, "cable_areas": cable_areas, "georeference": georeference}
    lost += [BESIDES[key] for key, given in besides.items() if given and key not in form.besides]
    surface = surface.cell if "images" in form.loses else surface
    if units and form.unit:
        surface = scaled_surface(surface, length_factor(units.length, form.unit))
        units = Units(form.unit, units.force)
    shown, walls = surface, None
    if form.separate:
        shown = standing_part(surface).surface
        if shown.m < surface.m and form.bare:
            lost.append(f"{surface.m - shown.m} triangles of walls without height")
        elif shown.m < surface.m:
            walls = encode_walls(surface, shown)
    bare = getattr(solved, "bare", ())
    without, counts = (*form.own, *{"order"} & {*form.loses}), (shown.n, shown.m)
    metadata = metadata_text(surface, units, not form.separate, without, counts, bare)
    findings: Any = certificate or {}
    if not isinstance(findings, Mapping):
        if not hasattr(findings, "FILED"):
            found = type(certificate).__name__
            text = f"certificate: expected a Certificate, found {found}"
            raise FileError(text, what="certificate", found=found)
        findings = {name: getattr(certificate, name) for name in findings.FILED}
    if findings or (mark and form.certificate):
        findings = {**findings, "mark": mark}
    mark = ", ".join(filter(None, (part_of_roof(surface), mark)))
    about = metadata, carried, colour, findings, walls, units, bare, members, cable_areas or {}, mark
    for name in carried:
        if re.sub(r"\s+", "_", name) in form.reserved:
            text = f"{path}: scalars: {path.suffix} files use the name {name!r} themselves; rename the scalar"
            raise FileError(text, what=str(path), where=name, found=name)
    with writing(path), atomic_write(path) as temporary:
        try:
            note = form.functions.write(temporary, shown, Content(*about, georeference))
        except PcmcError as error:
            raise error.in_file(path, FileError, str(path)) from None
    losses = ""
    if lost:
        lost += ["supports", "tensions", "pressures"] if form.bare else []
        losses = f"a {path.suffix} file cannot carry {', '.join(lost)}; left out"
    for text, kind in ((losses, LostWarning), (note, FileWarning)):
        if text and notes is not None:
            notes.append(text)
        elif text:
            warnings.warn(f"{path}: {text}", kind, stacklevel=2)


def _scalar(surface: Surface, name: str, value: npt.ArrayLike) -> Floats:
    checked_name("scalars", name)
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        refuse("scalars", value, "an array of numbers", where=name)
    if array.shape not in ((surface.n,), (surface.m,)):
        shapes = f"({surface.n},) for vertices or ({surface.m},) for faces"
        text = f"scalars[{name!r}]: expected shape {shapes}, found {array.shape}"
        raise FileError(text, what="scalars", where=name, found=array.shape)
    return array
