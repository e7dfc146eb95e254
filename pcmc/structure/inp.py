"""Write a structural model as the input file of CalculiX (``.inp``, in the language of Abaqus). Cables are
trusses: a beam would bend beside a held end over a length √(EI/τ), for a thick cable a whole bay.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, pairwise

import numpy as np

from ..base import validate
from ..base.arrays import Bools, Floats, Ints, format_rows
from ..base.files import as_path, atomic_write, check_name, suffix_of, writing
from ..certificate.supports import support_vertices
from ..forces.cables import pull_along
from ..forces.motion_space import perpendicular
from ..surface.geometry import unit_vectors
from .frames import bar_axes
from .loads import Step
from .material import Material
from .member_forces import forces_on_members, held_turns
from .model import StructuralModel, expect_model

PER_LINE = 12  # numbers of a set on a line; at most 16 are read
POINTS, CABLE_POINTS = 2, 8  # integration points: one above the other; a truss is expanded to a brick
FIELD = "%.12e"  # the longest number that fits into a field of 20 characters
LONGEST = 200  # characters of a comment
INCREMENT = 0.25  # of a step under added loads; it is halved where the equations do not converge
LEAST_INCREMENT = 1e-3  # where that does not help the analysis stops: the share of the load is known so well
PIECES = 4  # of a bar between two vertices
KINDS = {"membrane": ("M3D3", "MEMBRANE", "P1"), "shell": ("S3", "SHELL", "P")}
"""Elements by the words of the file: their type, their section, a pressure along their normal."""


def write_structure(path: str | os.PathLike[str], model: StructuralModel, mark: str = "") -> None:
    """Write a structural model as an input file of CalculiX; run it with ``ccx roof`` for ``roof.inp``.

    Vertex i is node i + 1, face f element f + 1: membranes of three nodes (``M3D3``) or shells (``S3``). Each
    starts with the stress α/t in its plane (``*INITIAL CONDITIONS, TYPE=STRESS``). Sets: ``PATCH_k``
    (elements), ``NODES_k`` of patch k, ``FIXED``, ``SLIDING`` and ``SUPPORT_B1``, ``SUPPORT_S1`` and so on,
    by the numbers in ``Certificate.supports``. ``mark`` is in the heading where the certificate has none.

    ``path`` has the suffix .inp; the file appears whole or not at all. FileError for another suffix, and
    where it cannot be written.
    """
    path = as_path(path)
    check_name(path)
    suffix_of(path, (".inp",), "a structural model")
    expect_model(model)
    text = text_of(model, model.steps, mark=validate.one_line("mark", mark))
    with writing(path), atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def text_of(
    model: StructuralModel, steps: Sequence[Step], every: bool = False, unit: float = 1.0, mark: str = ""
) -> str:
    """The input file of a model under these steps, the form-finding load first; with ``every`` it prints the
    results of each increment, and writes none for viewers. A length of 1 in the file is ``unit`` in the
    model."""
    surface, nodes, certificate = model.standing, np.flatnonzero(model.nodes), model.certificate
    mark = certificate.mark or mark
    heading = "pcmc structural model", mark, certificate.verdict.value, certificate.part
    text = [f"*HEADING\n{'; '.join(filter(None, heading))}\n" + (f"** {model.note}\n" if model.note else "")]
    supports = certificate.supports[["support", "kind", "name"]].to_numpy().tolist()
    parts = {"PATCH": surface.patches, "CABLE": surface.cables, "MEMBER": model.beams}
    notes = [f"{kind}_{k}: {one.name}" for kind, those in parts.items() for k, one in enumerate(those, 1)]
    notes += [f"SUPPORT_{label}: {kind}, {name}" for label, kind, name in supports]
    text += map(_comment, [*notes, *(f"step {k}: {step.name}" for k, step in enumerate(steps, 1))])
    text += [card("NODE, NSET=NALL", nodes + 1, surface.vertices[nodes] / unit)]
    text += chain(_elements(model, unit), _beams(model, unit), _ties(model))
    text += _supports(model)
    # σ = α/t (I - ν ν) in each element, ν its normal: uniform in its plane; τ/a t t along a cable's edge
    prestress = [(model.faces + 1, model.stresses, POINTS)]
    for cable, area, _, numbers, along in model.cable_edges():
        pull = pull_along(surface, cable, cable.edges)[:, None, None]
        prestress += [(numbers, pull / area * along[:, :, None] * along[:, None, :], CABLE_POINTS)]
    text.append("*INITIAL CONDITIONS, TYPE=STRESS\n")
    for elements, stress, points in prestress:  # a line for each integration point
        tensors = unit**2 * np.repeat(stress[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], points, axis=0)
        point = np.tile(np.arange(points), len(elements)) + 1
        text.append(_rows(np.repeat(elements, points), point, tensors))
    return "".join(chain(text, *(_step(model, step, k == 0, every, unit) for k, step in enumerate(steps))))


def _elements(model: StructuralModel, unit: float) -> Iterator[str]:
    """Elements, node sets, materials and sections by patch and by cable."""
    surface, (name, section, _) = model.standing, KINDS[model.elements]
    patch_of = surface.patch_of_face[model.active]
    for k in np.unique(patch_of) + 1:
        mine, material = patch_of == k - 1, model.materials[k - 1]
        thickness = short(model.thicknesses[k - 1] / unit)
        corners = surface.faces[model.active[mine]]
        yield card(f"ELEMENT, TYPE={name}, ELSET=PATCH_{k}", model.faces[mine] + 1, corners + 1)
        yield _set(f"NODES_{k}", np.unique(corners)) + _material(f"PATCH_{k}", material, unit)
        if not material.cloth:
            yield f"*{section} SECTION, ELSET=PATCH_{k}, MATERIAL=PATCH_{k}\n{thickness}\n"
            continue
        for a, (row, those) in enumerate(_alike(model.warps(k - 1).reshape(-1, 6)), 1):
            one = f"WARP_{k}_{a}"
            yield f"*ORIENTATION, NAME={one}, SYSTEM=RECTANGULAR\n{','.join(map(short, row))}\n"
            yield _set(one, model.faces[mine][those], "ELSET")
            yield f"*{section} SECTION, ELSET={one}, MATERIAL=PATCH_{k}, ORIENTATION={one}\n{thickness}\n"
    yield "*ELSET, ELSET=EALL\n" + "".join(f"PATCH_{k + 1},\n" for k in np.unique(patch_of))
    for k, (cable, area, material, numbers, _) in enumerate(model.cable_edges(), 1):
        own = surface.n + 1 + np.searchsorted(np.unique(model.member_nodes[0]), cable.edges)
        ends = own if model.elements == "shell" else cable.edges + 1
        yield card(f"ELEMENT, TYPE=T3D2, ELSET=CABLE_{k}", numbers, ends)
        yield _material(f"CABLE_{k}", material, unit)
        yield f"*SOLID SECTION, ELSET=CABLE_{k}, MATERIAL=CABLE_{k}\n{short(area / unit**2)}\n"
    if surface.cables:
        yield "*ELSET, ELSET=CABLES\n" + "".join(f"CABLE_{k + 1},\n" for k in range(len(surface.cables)))


def _beams(model: StructuralModel, unit: float) -> Iterator[str]:
    """Beams, as rectangles with the stiffness of their profiles; each bar in ``PIECES``, as each piece has
    one curvature: of a clamped beam of n pieces the program finds 1 - 4/n² of the deflection. Their weight is
    a load on their vertices, as in the frame."""
    X, up = model.standing.vertices, np.array(model.surface.plane.normal)
    (nodes, places), last = model.member_nodes, model.surface.n
    if len(nodes):
        yield card("NODE, NSET=MEMBERS", last + 1 + np.arange(len(nodes)), X[nodes] / unit)
    first = model.surface.m + 1 + sum(len(cable.edges) for cable in model.standing.cables)
    between = last + 1 + len(nodes)
    for k, (line, of) in enumerate(zip(model.beams, places, strict=True), 1):
        elements = first + np.arange(PIECES * len(line.pairs))
        own = between + np.arange((PIECES - 1) * len(line.pairs)).reshape(-1, PIECES - 1)
        first, between = first + elements.size, between + own.size
        width, height, factor = line.member.profile.equal_rectangle
        (a, b), share = X[line.pairs.T][:, :, None], np.arange(1, PIECES)[:, None] / PIECES
        yield card("NODE", own.ravel(), (a + share * (b - a)).reshape(-1, 3) / unit)
        ends = last + 1 + np.stack([of[:-1], of[1:]], axis=1)
        row = np.hstack([ends[:, :1], own, ends[:, 1:]])
        pieces = np.stack([row[:, :-1], row[:, 1:]], axis=2).reshape(-1, 2)
        yield card(f"ELEMENT, TYPE=B31, ELSET=MEMBER_{k}", elements, pieces)
        for a, (row, those) in enumerate(_alike(bar_axes(X, line.pairs, up)[0][:, 1]), 1):
            yield _set(f"MEMBER_{k}_{a}", elements[np.repeat(those, PIECES)] - 1, "ELSET")
            yield f"*BEAM SECTION, ELSET=MEMBER_{k}_{a}, MATERIAL=MEMBER_{k}, SECTION=RECT\n"
            yield f"{short(width / unit)},{short(height / unit)}\n{','.join(map(short, row))}\n"
        stiff = replace(line.member.material, young=factor * line.member.material.young, density=0.0)
        yield _material(f"MEMBER_{k}", stiff, unit)


def _ties(model: StructuralModel) -> Iterator[str]:
    """What ties the nodes of members to those of the sheets, and holds their ends. Where membranes and beams,
    or shells and cables, share nodes, the constraints that CalculiX makes for them contradict each other from
    one increment to the next, or it stops with "code 255"."""
    turns = held_turns(model, model.standing.vertices)
    nodes = model.member_nodes[0]
    for k, v in enumerate(nodes.tolist()):
        node = model.surface.n + 1 + k
        stops = {0: "123", 1: "23", 2: "1", 3: ""}[model.freedom[v] if model.held[v] else 3]
        if k in turns or stops not in ("", "123"):
            axes = model.axes[v]
            if k in turns and stops == "123":  # those that are held first
                held = _stopped_about(model, k, turns[k])
                axes = held if len(held) > 1 else np.concatenate([held, *perpendicular(held)])
            yield f"*NSET, NSET=BEAM_{node}\n{node}\n"
            yield card(f"TRANSFORM, NSET=BEAM_{node}, TYPE=R", axes[:2].reshape(1, 6))
        yield "".join(f"*BOUNDARY\n{node},{axis},{axis}\n" for axis in stops)
        if k in turns:
            yield f"*BOUNDARY\n{node},4,{3 + len(turns[k])}\n"
        for axis in sorted({"1", "2", "3"} - set(stops)):
            yield f"*EQUATION\n2\n{node},{axis},1.,{v + 1},{axis},-1.\n"
    fixed = np.unique(model.standing.cable_edges.ends)
    fixed = fixed[model.held[fixed] & (model.freedom[fixed] == 0)]
    if turns and len(fixed) and model.elements != "shell":
        # without axes at such ends of cables CalculiX may let the held turns of beams there go
        yield _set("CABLE_ENDS", fixed)
        yield card("TRANSFORM, NSET=CABLE_ENDS, TYPE=R", np.eye(3)[:2].reshape(1, 6))
    yield _set("ENDS", model.surface.n + np.flatnonzero(model.held[nodes]))


def _stopped_about(model: StructuralModel, node: int, turns: Floats) -> Floats:
    """(k,3) the axes about which CalculiX has to stop turns, to stop those about ``turns`` (k,3). Where one
    bar ends alone, with the section b · h, it stops the mean turn of the section's corners r about an axis a,

        Σ (a × r) · (ω × r) / r² = 4 (a_x ω_x + a_y ω_y h²/(b² + h²) + a_z ω_z b²/(b² + h²)) = 0,

    x along the bar, z upright: the components of a are those of the turn over these shares.
    """
    bars = [
        (line, pair)
        for line, of in zip(model.beams, model.member_nodes[1], strict=True)
        for pair, ends in zip(line.pairs, pairwise(of), strict=True)
        if node in ends
    ]
    if len(turns) > 1 or len(bars) > 1:
        return turns
    (line, pair), up = bars[0], np.array(model.surface.plane.normal)
    axes = bar_axes(model.standing.vertices, pair[None], up)[0][0]
    b, h, _ = line.member.profile.equal_rectangle
    return unit_vectors((turns @ axes.T / [1.0, h**2 / (b**2 + h**2), b**2 / (b**2 + h**2)]) @ axes)


def _material(name: str, material: Material, unit: float) -> str:
    """Of a cloth the numbers across its plane do not act: the stress there is 0."""
    text, v = f"*MATERIAL, NAME={name}\n*ELASTIC", short(material.poisson)
    E = short(material.young * unit**2)
    if material.weft is None or material.shear is None:
        text += f"\n{E},{v}\n"
    else:
        F, G = short(material.weft * unit**2), short(material.shear * unit**2)
        text += f", TYPE=ENGINEERING CONSTANTS\n{E},{F},{F},{v},0.,0.,{G},{G},\n{G}\n"
    return text + (f"*DENSITY\n{short(material.density * unit**4)}\n" if material.density > 0.0 else "")


def _supports(model: StructuralModel) -> Iterator[str]:
    """Node sets of the supports, and what these hold, in axes of their own where they slide."""
    held = model.held
    fixed, sliding = (np.flatnonzero(held & mask) for mask in (model.freedom == 0, model.freedom > 0))
    yield _set("HELD", np.flatnonzero(held)) + _set("FIXED", fixed) + _set("SLIDING", sliding)
    for label, vertices in support_vertices(model.certificate.acting).items():
        yield _set(f"SUPPORT_{label}", vertices[held[vertices]])
    if len(fixed):
        yield "*BOUNDARY\nFIXED,1,3\n"
    guides = np.hstack([model.axes[sliding].reshape(-1, 9), model.freedom[sliding, None]], dtype=np.float64)
    for k, (_, those) in enumerate(_alike(guides), 1):
        leader = sliding[those][0]
        yield _set(f"GUIDE_{k}", sliding[those])
        yield card(f"TRANSFORM, NSET=GUIDE_{k}, TYPE=R", model.axes[leader, :2].reshape(1, 6))
        yield f"*BOUNDARY\nGUIDE_{k},{'1,1' if model.freedom[leader] == 2 else '2,3'}\n"


def _step(model: StructuralModel, step: Step, form: bool, every: bool, unit: float) -> Iterator[str]:
    """A step of the analysis, with all loads that act at its end."""
    released = form and bool(model.lines)
    if released:  # members take over from what held the form, while its loads stay
        yield "*AMPLITUDE, NAME=WHOLE\n0.,1.,1.,1.\n"
        taken = _released(model, step)
        yield format_rows(f"*AMPLITUDE, NAME=AT_%d_%d\n0.,{FIELD},1.,{FIELD}\n", *taken)
    yield f"{_comment(step.name)}*STEP, NLGEOM, INC=1000\n*STATIC\n"
    yield f"{1.0 if form and not released else INCREMENT},1.,{LEAST_INCREMENT},1.\n"
    sets = ("EALL", "CABLES") if model.standing.cables else ("EALL",)
    label, pressures = KINDS[model.elements][2], step.pressures[model.active]
    patch_of, rows = model.standing.patch_of_face[model.active], list[str]()
    for k in np.unique(patch_of):
        values, names = pressures[patch_of == k], (model.faces[patch_of == k] + 1).tolist()
        even = [(f"PATCH_{k + 1}", values[0])] if (values == values[0]).all() else []
        loaded = even or zip(names, values, strict=True)
        rows += [f"{name},{label},{short(p * unit**2)}\n" for name, p in loaded if p]
    if step.gravity:
        down = ",".join(short(-c) for c in model.standing.plane.normal)
        heavy = {f"PATCH_{k + 1}": model.materials[k].density for k in np.unique(patch_of)}
        heavy = {"EALL": 1.0} if all(heavy.values()) else heavy
        heavy |= {f"CABLE_{k}": of.density for k, (_, of) in enumerate(model.cable_sections, 1)}
        pull = f"GRAV,{short(step.gravity / unit)},{down}"
        rows += [f"{name},{pull}\n" for name, dense in heavy.items() if dense]
    if not rows:  # without a line the loads of the step before would stay
        rows = [f"EALL,{label},0.\n"]
    yield "".join([f"*DLOAD, OP=NEW{', AMPLITUDE=WHOLE' if released else ''}\n", *rows])
    masses = sum((beam.masses(model.standing.vertices) for beam in model.beams), np.zeros(model.surface.n))
    forces = step.forces - step.gravity * np.outer(masses, model.standing.plane.normal)
    forces, others = np.einsum("nij,nj->ni", model.axes, forces), model.nodes
    if released:
        yield format_rows("*CLOAD, AMPLITUDE=AT_%d_%d\n%d,%d,1.\n", *taken[:2], *taken[:2])
        others = others & ~model.on_members
    if forces[others].any():
        vertex, axis = np.nonzero(forces * others[:, None])
        how = "AMPLITUDE=WHOLE" if released else "OP=NEW"
        yield card(f"CLOAD, {how}", vertex + 1, axis + 1, forces[vertex, axis])
    elif not form:
        yield f"*CLOAD, OP=NEW\n{int(np.flatnonzero(model.nodes)[0]) + 1},1,0.\n"
    printed = {"NODE PRINT, NSET=NALL": "U"} | {f"EL PRINT, ELSET={name}": "S" for name in sets}
    for name, held in (("HELD", model.held), ("ENDS", model.held[model.member_nodes[0]])):
        printed |= {f"NODE PRINT, NSET={name}": "RF"} if held.any() else {}
    for what, quantity in printed.items():
        yield f"*{what}, GLOBAL=YES, FREQUENCY={1 if every else 1000}\n{quantity}\n"
    if not every:
        yield "*NODE FILE, OUTPUT=2D, GLOBAL=YES, FREQUENCY=1000\nU,RF\n*EL FILE, OUTPUT=2D, GLOBAL=YES\nS\n"
    yield "*END STEP\n"


def _released(model: StructuralModel, step: Step) -> tuple[Ints, Ints, Floats, Floats]:
    """The nodes on members, their axes 1 to 3, and the force there when the step begins and ends: at first
    what keeps the members free of forces, at the end the loads alone; in one, as the program takes one
    course in time for each."""
    pulls = np.stack([step.forces, step.forces - forces_on_members(model, step)])
    end, start = np.einsum("nij,knj->kni", model.axes, pulls)
    vertex, axis = np.nonzero(((start != 0.0) | (end != 0.0)) & (model.nodes & model.on_members)[:, None])
    return vertex + 1, axis + 1, start[vertex, axis], end[vertex, axis]


def card(head: str, *columns: Ints | Floats) -> str:
    """A keyword line, and a data line for each row of columns (k,) or (k,c): integers, or floats in full.

    >>> card("NODE", np.array([7]), np.array([[0.5, -1.0]]))
    '*NODE\\n7,5.000000000000e-01,-1.000000000000e+00\\n'
    """
    return f"*{head}\n{_rows(*columns)}"


def _rows(*columns: Ints | Floats) -> str:
    parts = [part for column in columns for part in np.reshape(column, (len(column), -1)).T]
    row = ",".join("%d" if part.dtype.kind == "i" else FIELD for part in parts)
    return format_rows(f"{row}\n", *parts)


def _alike(values: Floats) -> Iterator[tuple[Floats, Bools]]:
    """The different rows of values (k,c), to rounding, and which rows (k,) are so."""
    rows, which = np.unique(values.round(9) + 0.0, axis=0, return_inverse=True)
    return ((row, which.ravel() == k) for k, row in enumerate(rows))


def _set(name: str, members: Ints, kind: str = "NSET") -> str:
    """A set of vertices or faces, whose numbers are one more."""
    numbers = (np.asarray(members) + 1).astype(str)
    rows = [",".join(numbers[k : k + PER_LINE]) + "\n" for k in range(0, len(numbers), PER_LINE)]
    return "".join([f"*{kind}, {kind}={name}\n", *rows] if rows else [])


def short(value: float) -> str:
    """A number in at most 20 characters, the field of an input file.

    >>> short(-1e-5 / 3)
    '-3.33333333333e-06'
    """
    return f"{value:.12g}"


def _comment(text: str) -> str:
    return f"** {' '.join(text.split())[:LONGEST]}\n"
