"""Write a structural model as the input file of CalculiX (``.inp``, in the language of Abaqus)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base import validate
from ..base.arrays import Floats, Ints
from ..base.files import atomic_write, check_name, suffix_of, writing
from ..certificate.supports import support_vertices
from ..io.text import format_rows
from ..surface.geometry import area_vectors
from . import cables
from .cables import short
from .loads import Step
from .model import Material, StructuralModel

PER_LINE = 12  # numbers of a set on a line; at most 16 are read
POINTS = 2  # integration points of an element, one above the other
FIELD = "%.12e"  # the longest number that fits into a field of 20 characters
LONGEST = 200  # characters of a comment
INCREMENT = 0.25  # of a step under added loads; it is halved where the equations do not converge


@dataclass(frozen=True)
class Kind:
    """Elements by the words of the file: their type, their section, a pressure along their normal."""

    name: str
    section: str
    pressure: str


KINDS = {"membrane": Kind("M3D3", "MEMBRANE", "P1"), "shell": Kind("S3", "SHELL", "P")}


def write_structure(path: str | os.PathLike[str], model: StructuralModel) -> None:
    """Write a structural model as an input file of CalculiX; run it with ``ccx roof`` for ``roof.inp``.

    Vertex i is node i + 1, face f element f + 1: membranes of three nodes (``M3D3``) or shells (``S3``). Each
    starts with the stress α/t in its plane (``*INITIAL CONDITIONS, TYPE=STRESS``). Sets: ``PATCH_k``
    (elements), ``NODES_k`` of patch k, ``FIXED``, ``SLIDING`` and ``SUPPORT_B1``, ``SUPPORT_S1`` and so on,
    by the numbers in ``Certificate.supports``.

    Parameters
    ----------
    path : the file, with the suffix .inp; it appears whole or not at all.
    model : the structural model.

    Raises
    ------
    FileError : for another suffix, and where the file cannot be written.
    """
    path = Path(path)
    check_name(path)
    suffix_of(path, (".inp",), "a structural model")
    if not isinstance(model, StructuralModel):
        validate.refuse("model", type(model).__name__, "a StructuralModel")
    text = "".join(_sections(model))
    with writing(path), atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _sections(model: StructuralModel) -> Iterator[str]:
    """The text of the file, part by part."""
    surface, nodes = model.standing, np.flatnonzero(model.nodes)
    verdict = model.verdict if model.certified else f"NOT CERTIFIED: {model.verdict}"
    yield f"*HEADING\npcmc structural model, {verdict}\n"
    yield f"** {model.note}\n" if model.note else ""
    yield "".join(f"** PATCH_{k}: {_line(patch.name)}\n" for k, patch in enumerate(surface.patches, 1))
    assert model.certificate is not None  # a model has that of its surface
    supports = model.certificate.supports[["support", "kind", "name"]].to_numpy().tolist()
    yield "".join(f"** SUPPORT_{label}: {kind}, {_line(name)}\n" for label, kind, name in supports)
    yield "".join(f"** step {k}: {_line(step.name)}\n" for k, step in enumerate(model.steps, 1))
    yield "*NODE, NSET=NALL\n"
    yield format_rows(f"%d,{FIELD},{FIELD},{FIELD}\n", nodes + 1, *surface.vertices[nodes].T)
    yield from _elements(model)
    yield from _supports(model)
    yield from _prestress(model)
    for k, step in enumerate(model.steps):
        yield from _step(model, step, form=k == 0)


def _elements(model: StructuralModel) -> Iterator[str]:
    """Elements, node sets and sections by patch, and the material."""
    surface, material, kind = model.standing, model.material, KINDS[model.elements]
    present = []
    for k, thickness in enumerate(model.thicknesses.tolist(), 1):
        mine = surface.patch_of_face[model.active] == k - 1
        if not mine.any():
            continue
        corners = surface.faces[model.active[mine]]
        present.append(k)
        yield f"*ELEMENT, TYPE={kind.name}, ELSET=PATCH_{k}\n"
        yield format_rows("%d,%d,%d,%d\n", model.faces[mine] + 1, *(corners.T + 1))
        yield _set(f"NODES_{k}", np.unique(corners))
        yield f"*{kind.section} SECTION, ELSET=PATCH_{k}, MATERIAL=MEMBRANE\n{short(thickness)}\n"
    yield "*ELSET, ELSET=EALL\n" + "".join(f"PATCH_{k},\n" for k in present)
    yield _material("MEMBRANE", material)
    if surface.cables:
        yield from cables.cable_elements(surface, model.cable_areas, first_cable(model))
        yield _material("CABLE", model.cable_material or material)


def first_cable(model: StructuralModel) -> int:
    """The number of the first cable element."""
    return model.surface.m + 1


def _material(name: str, material: Material) -> str:
    text = f"*MATERIAL, NAME={name}\n*ELASTIC\n{short(material.young)},{short(material.poisson)}\n"
    return text + (f"*DENSITY\n{short(material.density)}\n" if material.density > 0.0 else "")


def _supports(model: StructuralModel) -> Iterator[str]:
    """Node sets of the supports, and what these hold, in axes of their own where they slide."""
    held = model.held
    yield _set("HELD", np.flatnonzero(held))
    yield _set("FIXED", np.flatnonzero(held & (model.freedom == 0)))
    yield _set("SLIDING", np.flatnonzero(held & (model.freedom > 0)))
    assert model.certificate is not None  # a model has that of its surface
    for label, vertices in support_vertices(model.certificate.acting).items():
        yield _set(f"SUPPORT_{label}", vertices[held[vertices]])
    if (held & (model.freedom == 0)).any():
        yield "*BOUNDARY\nFIXED,1,3\n"
    sliding = np.flatnonzero(held & (model.freedom > 0))
    if not len(sliding):
        return
    alike = np.column_stack([model.axes[sliding].reshape(-1, 9), model.freedom[sliding]]).round(9) + 0.0
    _, first, which = np.unique(alike, axis=0, return_index=True, return_inverse=True)
    for k, leader in enumerate(sliding[first]):
        members = sliding[which.ravel() == k]
        yield _set(f"GUIDE_{k + 1}", members)
        yield f"*TRANSFORM, NSET=GUIDE_{k + 1}, TYPE=R\n"
        yield ",".join(FIELD % c for c in model.axes[leader, :2].ravel()) + "\n"
        yield f"*BOUNDARY\nGUIDE_{k + 1},{'1,1' if model.freedom[leader] == 2 else '2,3'}\n"


def _prestress(model: StructuralModel) -> Iterator[str]:
    """σ = α/t (I - ν ν) in each element, ν its normal: uniform tension in its plane."""
    surface, elements = model.standing, model.active
    normals = area_vectors(surface.vertices[surface.faces[elements]])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    stress = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    stress *= model.prestress[:, None, None]
    yield "*INITIAL CONDITIONS, TYPE=STRESS\n" + _stresses(model.faces + 1, stress, POINTS)
    if surface.cables:
        stress = cables.cable_stress(surface, model.cable_areas)
        yield _stresses(first_cable(model) + np.arange(len(stress)), stress, cables.POINTS)


def _stresses(elements: Ints, stress: Floats, points: int) -> str:
    """A line for each integration point of elements (k,) with stress tensors (k,3,3)."""
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    values = np.repeat(stress[:, rows, columns], points, axis=0)
    point = np.tile(np.arange(1, points + 1), len(elements))
    return format_rows("%d,%d" + f",{FIELD}" * 6 + "\n", np.repeat(elements, points), point, *values.T)


def _step(model: StructuralModel, step: Step, form: bool) -> Iterator[str]:
    """A step of the analysis, with all loads that act at its end."""
    yield f"** {_line(step.name)}\n*STEP, NLGEOM, INC=1000\n*STATIC\n{1.0 if form else INCREMENT},1.\n"
    patches = np.unique(model.standing.patch_of_face[model.active])
    label = KINDS[model.elements].pressure
    rows = [
        f"PATCH_{k + 1},{label},{short(step.pressures[k])}\n" for k in patches if step.pressures[k] != 0.0
    ]
    if step.gravity:
        down = ",".join(short(-c) for c in model.standing.plane.normal)
        sets = ("EALL", "CABLES") if model.standing.cables else ("EALL",)
        rows += [f"{name},GRAV,{short(step.gravity)},{down}\n" for name in sets]
    if rows:
        yield "*DLOAD, OP=NEW\n" + "".join(rows)
    forces = np.einsum("nij,nj->ni", model.axes, step.forces)
    vertex, axis = np.nonzero(forces * model.nodes[:, None])
    if len(vertex):
        yield "*CLOAD, OP=NEW\n"
        yield format_rows(f"%d,%d,{FIELD}\n", vertex + 1, axis + 1, forces[vertex, axis])
    elif not form:
        yield f"*CLOAD, OP=NEW\n{int(np.flatnonzero(model.nodes)[0]) + 1},1,0.\n"
    yield "*NODE PRINT, NSET=NALL, GLOBAL=YES, FREQUENCY=1000\nU\n"
    if model.held.any():
        yield "*NODE PRINT, NSET=HELD, GLOBAL=YES, FREQUENCY=1000\nRF\n"
    yield "*EL PRINT, ELSET=EALL, GLOBAL=YES, FREQUENCY=1000\nS\n"
    if model.standing.cables:
        yield "*EL PRINT, ELSET=CABLES, GLOBAL=YES, FREQUENCY=1000\nS\n"
    yield "*NODE FILE, OUTPUT=2D, GLOBAL=YES, FREQUENCY=1000\nU,RF\n*EL FILE, OUTPUT=2D, GLOBAL=YES\nS\n"
    yield "*END STEP\n"


def _set(name: str, vertices: Ints) -> str:
    """A node set; empty text for none."""
    if not len(vertices):
        return ""
    numbers = (np.asarray(vertices) + 1).astype(str)
    rows = (",".join(numbers[k : k + PER_LINE]) for k in range(0, len(numbers), PER_LINE))
    return f"*NSET, NSET={name}\n" + "".join(f"{row}\n" for row in rows)


def _line(text: str) -> str:
    """The text in one line of at most LONGEST characters."""
    return " ".join(text.split())[:LONGEST]
