"""Read the tables of CalculiX's ``.dat`` files, as arrays on the surface's vertices and faces."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from ..base.arrays import Bools, Floats, Ints, cached_array
from ..base.errors import FileError, OptionError
from ..base.files import check_regular, suffix_of, system_error
from ..forces.cables import directions
from ..surface.geometry import area_vectors, segment_lengths, unit_vectors
from .loads import Step, nothing
from .model import StructuralModel, expect_model

LEFT = 0.01  # of a squared thickness: a law of constant E and ν holds for no strain that leaves less
WHOLE = 1e-6  # of a step: a time so near to its end is the end
EXPONENT = re.compile(r"(?<=\d)([+-]\d{3})\b")  # Fortran leaves out the E before three digits
DAT_HEAD = re.compile(r"^ *([a-z]+) \((.*)\) for set (\S+) and time +(\S+)[^\S\n]*$", re.M)
KEYS = {"displacements": 1, "forces": 1, "stresses": 2}  # numbers before the 3, 3 or 6 values of a row
POWERS = {"displacements": 1, "forces": 0, "stresses": -2}  # of the unit of length
SETS = {"CABLES": "cables", "ENDS": "ends"}  # sets of elements and nodes with tables of their own
OWNERS = {"stresses": "elements", "cables": "cable elements", "forces": "held nodes"}  # of others nodes


@dataclass(frozen=True, eq=False)
class StepResults:
    """The end of one step of the analysis. Vertices and faces that are not in the model have NaN."""

    name: str  # of the step
    model: StructuralModel
    displacements: Floats  # (n,3) length
    reactions: Floats  # (n,3) forces of the supports on the structure; zero at vertices that nothing holds
    stresses: Floats  # (m,3,3) tensors in the axes of space, force/area, the mean over the thickness
    cable_tensions: Mapping[str, Floats]  # (k,) of the edges of each cable by name, force
    step: Step  # its loads, as far as they act
    share: float = 1.0  # of the step's loads, besides those of the step before: 1 but where it stopped
    taut: float = 1.0  # the part of that share up to which no face is slack, between increments by a line

    @cached_array
    def deflections(self) -> Floats:
        """(n,) displacement along Π's normal, length: negative downwards."""
        return self.displacements @ np.array(self.model.surface.plane.normal)

    @cached_array
    def principal_stresses(self) -> Floats:
        """(m,2) the two principal membrane stresses in each face's plane under the loads, ascending,
        force/area."""
        values = np.full((self.model.surface.m, 2), np.nan)
        values[self.model.faces] = _in_planes(self._corners, self.stresses[self.model.faces])
        return values

    @property
    def _corners(self) -> Floats:
        """(e,3,3) the corners of the elements under the loads."""
        standing = self.model.standing
        return (standing.vertices + self.displacements)[standing.faces[self.model.active]]

    @cached_array
    def thicknesses(self) -> Floats:
        """(m,) thickness of each face under the loads, t √(1 - ν (tr C - 2) / (1 - ν)), length.

        C is the right Cauchy-Green tensor in its plane: stretched sheets are drawn in. Cloth keeps its t.
        OptionError for a strain at which the material's law has almost no thickness left.
        """
        model, standing = self.model, self.model.standing
        faces, patch = standing.faces[model.active], standing.patch_of_face[model.active]
        both = (P[:, 1:] - P[:, :1] for P in (standing.vertices[faces], self._corners))
        metrics = [edges @ edges.swapaxes(1, 2) for edges in both]
        thinner = [0.0 if of.cloth else of.poisson / (1.0 - of.poisson) for of in model.materials]
        growth = np.trace(np.linalg.solve(*metrics), axis1=1, axis2=2) - 2.0
        values, left = model.thicknesses[model.surface.patch_of_face], 1.0 - np.array(thinner)[patch] * growth
        _check_strain(self.step, f"patch {model.surface.patches[patch[left.argmin()]].name!r}", left)
        values[model.faces] *= np.sqrt(left)
        return values

    @cached_array
    def principal_forces(self) -> Floats:
        """(m,2) the principal stresses times the thickness, force/length, to compare with the tension α."""
        return self.principal_stresses * self.thicknesses[:, None]

    @cached_array
    def slack(self) -> Bools:
        """(m,) the faces where a principal stress is not above 0: there a membrane wrinkles."""
        return self.principal_stresses[:, 0] <= 0.0

    @cached_property
    def largest_displacement(self) -> float:
        """The largest displacement of a vertex, length."""
        return float(np.nanmax(np.linalg.norm(self.displacements, axis=1)))


def read_results(path: str | os.PathLike[str], model: StructuralModel) -> tuple[StepResults, ...]:
    """Displacements, reactions and stresses of each step, from CalculiX's ``.dat`` file.

    The program's force at a held node is that of the elements alone; the load that acts on the node itself
    (a third of its triangles' pressures, its weight and snow) is added here, so that the reactions are those
    of ``pcmc.certify``.

    ``path`` is what ``ccx`` wrote for the input file of the model.
    FileError for a file that is missing, damaged, incomplete, or of another model.
    """
    expect_model(model)
    path = Path(path)
    steps = read_steps(path, model, model.steps)
    ended = len(steps) - (bool(steps) and steps[-1].share < 1.0)
    if ended < len(model.steps):
        text = f"{path}: has {ended} of the model's {len(model.steps)} steps"
        where = f"ccx stopped in step {model.steps[ended].name!r}; pcmc.analyse finds how far the load goes"
        raise FileError(f"{text}; {where}", what=str(path), found=ended, expected=len(model.steps))
    return steps


def read_steps(
    path: Path, model: StructuralModel, steps: Sequence[Step], unit: float = 1.0
) -> tuple[StepResults, ...]:
    """The same for other ``steps`` of the model. Where the program stopped, the last results are those of the
    ``share`` of the step that it reached; steps that it did not begin are left out. A length of 1 in the file
    is ``unit`` in the model."""
    check_regular(path)
    suffix_of(path, (".dat",), "a result of CalculiX")
    try:
        tables = read_tables(path.read_text(encoding="ascii"), unit)
        _check(tables, model, steps)
    except OSError as error:
        raise system_error(path, "read", error) from None
    except UnicodeDecodeError as error:
        message = f"{path}: byte {error.start} is not text; the file is damaged"
        raise FileError(message, what=str(path), where=error.start) from None
    except FileError as error:
        raise error.in_file(path, what=str(path)) from None
    return tuple(_results(model, steps, k, tables) for k in range(len(tables)))


def _results(model: StructuralModel, steps: Sequence[Step], k: int, tables: list[Tables]) -> StepResults:
    """The arrays of step k on the surface's vertices and faces; only the standing faces are elements."""
    blocks = {kind: of_increments[-1] for kind, of_increments in tables[k].items()}
    step, surface = steps[k], model.standing
    share = blocks["displacements"].time - k
    if share < 1.0 - WHOLE:
        before = steps[k - 1] if k else nothing(step)
        step = replace(before.plus(step, before, share), name=step.name)
    displacements, reactions = np.full((surface.n, 3), np.nan), np.zeros((surface.n, 3))
    displacements[blocks["displacements"].ids - 1] = blocks["displacements"].values
    if "forces" in blocks:
        reactions[blocks["forces"].ids - 1] = blocks["forces"].values
        if "ends" in blocks:  # of members, at nodes of their own
            ends = model.member_nodes[0][blocks["ends"].ids - 1 - surface.n]
            np.add.at(reactions, ends, blocks["ends"].values)
        reactions -= model.nodal_loads(step, np.nan_to_num(displacements))
        reactions[~model.held] = 0.0
        reactions -= np.einsum("nij,nj->ni", model.allowed, reactions)
    stresses = np.full((model.surface.m, 3, 3), np.nan)
    stresses[model.faces] = blocks["stresses"].tensors(model.faces + 1)
    tensions, moved = {}, surface.vertices + displacements
    for cable, area, of, numbers, _ in model.cable_edges() if "cables" in blocks else ():
        mine, along = blocks["cables"].tensors(numbers), directions(moved, cable.edges)[0]
        stretch = segment_lengths(moved, cable.edges) / segment_lengths(surface.vertices, cable.edges)
        left = 1.0 - of.poisson * (stretch**2 - 1.0)  # of its section, as far as it is drawn in
        _check_strain(step, f"cable {cable.name!r}", left)
        tensions[cable.name] = area * left * np.einsum("ki,kij,kj->k", along, mine, along)
    done = 1.0 if share >= 1.0 - WHOLE else share
    taut = min(_taut(model, k, tables), done)
    return StepResults(step.name, model, displacements, reactions, stresses, tensions, step, done, taut)


def _check_strain(step: Step, what: str, left: Floats) -> None:
    """Refuse a strain that thins a sheet or cable too much; ``left``: share of thickness² or section."""
    if left.min() < LEFT:
        text = f"{step.name}: {what} stretches so far that the material's law leaves it no thickness"
        raise OptionError(f"{text}; give it a larger young or thickness, or less load", what="Material.young")


def _taut(model: StructuralModel, k: int, tables: list[Tables]) -> float:
    """The time in step k at which the first face gets slack, by lines through the least principal stress at
    the increments, from the end of the step before on; 1 if none does."""
    X, F = model.standing.vertices.copy(), model.standing.faces[model.active]
    before = tables[k - 1] if k else {}
    both = [before.get(kind, [])[-1:] + tables[k][kind] for kind in ("displacements", "stresses")]
    least = [] if k else [(0.0, float(model.prestress.min()))]
    for moved, block in zip(*both, strict=True):
        X[moved.ids - 1] = model.standing.vertices[moved.ids - 1] + moved.values
        least.append((block.time - k, float(_in_planes(X[F], block.tensors(model.faces + 1)).min())))
    for (time, start), (end, after) in pairwise(least):
        if after <= 0.0:
            return time + (end - time) * start / (start - after) if start > 0.0 else time
    return 1.0


def _in_planes(P: Floats, stresses: Floats) -> Floats:
    """(k,2) the principal values, ascending, of tensors (k,3,3) in the planes of triangles (k,3,3)."""
    first, normal = unit_vectors(P[:, 1] - P[:, 0]), unit_vectors(area_vectors(P))
    plane = np.stack([first, np.cross(normal, first)], axis=1)
    return np.asarray(np.linalg.eigvalsh(plane @ stresses @ plane.transpose(0, 2, 1)), dtype=np.float64)


def _check(tables: list[Tables], model: StructuralModel, steps: Sequence[Step]) -> None:
    """Refuse results with other nodes or elements than the model's, and more steps."""
    nodes, held = (np.flatnonzero(mask) + 1 for mask in (model.nodes, model.held))
    cables = np.array([number for *_, numbers, _ in model.cable_edges() for number in numbers])
    known = {"displacements": nodes, "stresses": model.faces + 1, "forces": held, "cables": cables}
    for number, blocks in enumerate(tables[: len(steps)], 1):
        for kind in ("displacements", "stresses", *["forces"] * bool(len(held))):
            if kind not in blocks:
                text = f"step {number} has no {kind}; run ccx on the model's file again"
                raise FileError(text, where=number)
        if len(blocks["displacements"]) != len(blocks["stresses"]):
            text = f"step {number} ends within an increment; run ccx on the model's file again"
            raise FileError(text, where=number)
        for kind, of_increments in blocks.items():
            for own in (np.unique(block.ids) for block in of_increments):
                if kind == "forces":
                    _check_numbers("nodes", np.union1d(own, nodes), nodes)
                    own = np.intersect1d(own, held)
                _check_numbers(OWNERS.get(kind, "nodes"), own, known.get(kind, own))
    if len(tables) > len(steps):
        text = f"has {len(tables)} steps, the model {len(steps)}; is it another model's?"
        raise FileError(text, found=len(tables), expected=len(steps))


def _check_numbers(what: str, own: Ints, numbers: Ints) -> None:
    if len(own) != len(numbers):
        text = f"has {len(own)} {what}, the model {len(numbers)}; they belong to different surfaces"
        raise FileError(text, found=len(own), expected=len(numbers))
    for other in own[own != numbers][:1].tolist():
        text = f"its {what} are numbered otherwise than the model's ({other} is not there)"
        raise FileError(text, where=other)


class ResultBlock(NamedTuple):
    """One quantity at one increment, by ascending numbers of nodes or elements."""

    time: float
    ids: Ints  # (k,) numbers of nodes or elements
    values: Floats  # (k,3) vectors, or (k,6) stresses xx, yy, zz, xy, xz, yz

    def tensors(self, elements: Ints) -> Floats:
        """(k,3,3) the mean over the integration points of each of the elements (k,), ascending numbers."""
        means = pd.DataFrame(self.values).groupby(self.ids).mean()
        return means.loc[elements].to_numpy()[:, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]


Tables = dict[str, list[ResultBlock]]
"""Of a step, by quantity, at each of its increments that was printed."""


def read_tables(text: str, unit: float = 1.0) -> list[Tables]:
    """The tables of each step, which end at the times 1, 2, ...: the last block of an analysis that stopped
    has what it reached. A length of 1 in the file is ``unit`` in the tables; forces are the same.

    >>> text = " displacements (vx,vy,vz) for set NALL and time  0.1000000E+01\\n\\n 2 0.5 0. -1.E-3\\n"
    >>> read_tables(text)[0]["displacements"][-1].values.tolist()
    [[0.5, 0.0, -0.001]]
    """
    steps, heads = list[Tables](), list(DAT_HEAD.finditer(text))
    if not heads:
        raise FileError("has no results; is it a .dat file of ccx, and has its analysis run?")
    for head, end in zip(heads, [*(head.start() for head in heads[1:]), len(text)], strict=True):
        kind, line = head[1], text.count("\n", 0, head.start()) + 1
        if kind in KEYS:
            body = re.sub(r"[^\S\n]_\S+", "", text[head.end() : end])  # names of local axes
            words = EXPONENT.sub(r"E\1", body).split()
            rows = _numbers(words, 8 if kind == "stresses" else 4, kind, line)
            rows = rows[np.argsort(rows[:, 0], kind="stable")]
            time = float(_numbers([head[4]], 1, "time", line)[0, 0])
            number = max(math.ceil(time - WHOLE), 1)
            steps += [{} for _ in range(number - len(steps))]
            values = unit ** POWERS[kind] * rows[:, KEYS[kind] :]
            block = ResultBlock(time, rows[:, 0].astype(int), values)
            steps[number - 1].setdefault(SETS.get(head[3], kind), []).append(block)
    return steps


def _numbers(words: list[str], columns: int, what: str, line: int) -> Floats:
    """(k,columns) the words of a table; an error names the table and the line where it starts."""
    try:
        values = np.array(words, dtype=float)
    except ValueError as error:
        raise FileError(f"line {line}: the {what} cannot be read ({error})", where=line) from None
    if len(values) % columns or not len(values):
        raise FileError(f"line {line}: the {what} are cut off; run ccx again", where=line)
    table = values.reshape(-1, columns)
    if not np.isfinite(table).all():
        raise FileError(f"line {line}: the {what} are not finite; the analysis failed", where=line)
    return table
