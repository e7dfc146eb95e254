"""Columns and stays: their forces, by statics alone, from what the points of supports carry.

A point that holds the roof exerts the force R on it. Bars from there to their feet, in the directions d_i of
length 1, with the forces N_i, tension above 0, pull the point with Σ N_i d_i. So

    Σ N_i d_i = R

has one solution for three bars that are not in one plane. One or two bars leave the part of R that is across
them; the forces are those of least squares then. Their own weight is left out. A column, hinged at both ends,
buckles under Euler's load π² E I / L², I the smaller second moment.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pandas as pd

from ..base.arrays import Floats
from ..base.units import Units
from ..surface.pieces import point_text
from .member_forces import forces_on_members, frame_of
from .members import Bar
from .model import StructuralModel

LEAST = 0.01  # of the force at a point: a smaller part that bars leave is not told
COLUMNS = ["case", "member", "kind", *"xyz", "length", "N", "stress", "utilisation", "euler", "euler_over"]
COLUMNS += [f"left_{axis}" for axis in "xyz"]


def reactions_at_rest(model: StructuralModel) -> Floats:
    """(n,3) the forces of supports on the roof at rest; at the ends of beams with what these carry there."""
    found: Floats = model.certificate.reactions.copy()
    if model.beams:
        frame, vertices = frame_of(model, model.standing.vertices)
        found[vertices] = frame.solved(forces_on_members(model, model.steps[0])[vertices]).reactions
    return found


def column_table(model: StructuralModel, cases: Iterable[tuple[str, Floats]]) -> pd.DataFrame:
    """A row per case and bar, from the reactions (n,3) in each case.

    Columns: ``case``, ``member``, ``kind``, column or stay; ``x``, ``y``, ``z`` of the point that it holds;
    ``length``; ``N``, tension above 0; ``stress`` N/A; ``utilisation``, |stress| over the strength, NaN where
    that is not given; ``euler``, the load under which a column buckles, and ``euler_over``, that over the
    thrust, NaN without one; ``left_x``, …, the force that the bars at the point leave to others.
    """
    rows = list[list[object]]()
    for case, reactions in cases:
        for vertex in dict.fromkeys(bar.vertex for bar in model.bars):
            own = [bar for bar in model.bars if bar.vertex == vertex]
            directions, force = np.array([bar.direction for bar in own]), reactions[vertex]
            forces = np.linalg.lstsq(directions.T, force, rcond=None)[0]
            left = force - forces @ directions
            rows += [_row(case, bar, N, left) for bar, N in zip(own, forces.tolist(), strict=True)]
    return pd.DataFrame(rows, columns=COLUMNS)


def _row(case: str, bar: Bar, N: float, left: Floats) -> list[object]:
    stress, strength, euler = N / bar.member.profile.area, bar.member.strength, euler_load(bar)
    used = abs(stress) / strength if strength else math.nan
    over = euler / -N if N < 0.0 else math.nan
    return [case, bar.name, bar.kind, *bar.points[0], bar.length, N, stress, used, euler, over, *left]


def euler_load(bar: Bar) -> float:
    """π² E I / L² of a column with hinged ends; NaN of a stay."""
    member = bar.member
    stiffness = member.material.young * min(member.profile.moments)
    return math.pi**2 * stiffness / bar.length**2 if bar.kind == "column" else math.nan


def columns_at_rest(model: StructuralModel) -> pd.DataFrame:
    """The table of columns and stays under the form-finding load, without CalculiX."""
    return column_table(model, [(model.steps[0].name, reactions_at_rest(model))] if model.bars else [])


def column_answers(model: StructuralModel, table: pd.DataFrame, units: Units) -> list[str]:
    """A line for each column or stay that cannot be, in its worst case, and for each force left."""
    lines, force = list[str](), units.behind("force")
    for bar in model.bars:
        own = table[table["member"] == bar.name]
        row = own.iloc[int(own["N"].to_numpy().argmin())]
        thrust = f"{row['case']}: {bar.name} is pressed with {-row['N']:.3g}{force}"
        if bar.kind == "stay" and row["N"] < 0.0:
            lines.append(f"{thrust}, but a stay can only pull; move its anchor, or make it a column")
        if row["euler_over"] < 1.0:
            stiffer = f"it needs {1.0 / row['euler_over']:.2g} times its E I, without any safety"
            lines.append(f"{thrust} and buckles under {row['euler']:.3g}{force}; {stiffer}")
        if (worst := own["utilisation"].max()) > 1.0:
            case = own["case"].iloc[int(np.nanargmax(own["utilisation"]))]
            lines.append(f"{case}: {bar.name} has {worst:.2g} times the stress of its strength")
    for _, own in table.groupby([*"xyz"], sort=False):
        left = own[["left_x", "left_y", "left_z"]].to_numpy()
        sizes = np.linalg.norm(left, axis=1)
        far = int(sizes.argmax())
        row, names = own.iloc[far], list(dict.fromkeys(own["member"]))
        if sizes[far] > LEAST * (np.abs(own["N"]).max() + sizes[far]):
            text = f"{row['case']}: across {' and '.join(names)} {sizes[far]:.3g}{force} are left,"
            lines.append(f"{text} {_vector(left[far])}; {_hint(model, names, row['N'], left[far])}")
    return lines


def column_text(model: StructuralModel, table: pd.DataFrame, units: Units) -> str:
    """The main columns of the table, and the answers, a line each."""
    shown = table[["case", "member", "length", "N", "stress", "utilisation", "euler", "euler_over"]]
    shown = shown.dropna(axis=1, how="all")
    text = shown.to_string(index=False, float_format="{:.4g}".format, na_rep="-")
    return "\n".join([text, *column_answers(model, table, units)])


def _hint(model: StructuralModel, names: list[str], N: float, left: Floats) -> str:
    """Where a column alone would have to stand, or that a stay is missing."""
    bar = next(bar for bar in model.bars if bar.name == names[0])
    force, normal = N * bar.direction + left, np.array(model.surface.plane.normal)
    drop, rate = normal @ (bar.points[1] - bar.points[0]), normal @ force
    if len(names) > 1 or drop * rate == 0.0 or N >= 0.0:
        return "add a stay, or clamp the column's foot"
    return f"with its foot at {_vector(bar.points[0] + drop / rate * force)} it would carry all; or add stays"


def _vector(value: Floats) -> str:
    return point_text(np.array([float(f"{c:.3g}") + 0.0 for c in value]))
