"""Columns and stays: their forces, by statics alone, from what the points of supports carry; with these and
those of beams and cables, all members at rest.

A point that holds the roof exerts the force R on it. Bars from there to their feet, in the directions d_i of
length 1, with the forces N_i, tension above 0, pull the point with Σ N_i d_i. So

    Σ N_i d_i = R,    N_i ≥ 0 of stays,

has one solution for three bars that are not in one plane, if it leaves no stay in compression. Fewer bars, or
a stay that is slack, leave a part of R; the forces are those of least squares then. Their own weight is left
out. A column, hinged at both ends, buckles under Euler's load π² E I / L², I the smaller second moment.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import product

import numpy as np
import pandas as pd
from scipy.optimize import lsq_linear

from ..base.arrays import Floats
from ..base.units import Units
from ..forces.cables import pull_along
from ..surface.pieces import point_text
from .member_forces import forces_on_members, frame_of, members_at_rest
from .members import PlacedMember, at_points
from .model import StructuralModel

LEAST = 0.01  # of the force at a point: a smaller part that bars leave is not told, nor a smaller thrust
COLUMNS = ["case", "member", "kind", *"xyz", "length", "N", "stress", "utilisation", "euler", "euler_over"]
COLUMNS += ["slack", *(f"left_{axis}" for axis in "xyz")]


def columns_at_rest(model: StructuralModel) -> pd.DataFrame:
    """The table of columns and stays under the form-finding load, without CalculiX; at the ends of beams with
    what these carry there."""
    reactions: Floats = model.certificate.reactions.copy()
    if model.beams and model.bars:
        frame, vertices = frame_of(model, model.standing.vertices)
        forces = forces_on_members(model, model.steps[0])[vertices] / np.bincount(vertices)[vertices, None]
        reactions[vertices] = 0.0
        np.add.at(reactions, vertices, frame.solved(forces).reactions)
    return column_table(model, [(model.steps[0].name, reactions)])


def column_table(model: StructuralModel, cases: Iterable[tuple[str, Floats]]) -> pd.DataFrame:
    """A row per case and bar, from the reactions (n,3) in each case. Columns: ``case``, ``member``, ``kind``,
    column or stay; ``x``, ``y``, ``z`` of the point that it holds; ``length``; ``N``, tension above 0;
    ``stress`` N/A; ``utilisation``, |stress| over the strength, NaN where that is not given; ``euler``, the
    load under which a column buckles, and ``euler_over``, that over the thrust, NaN without one; ``slack``,
    whether it is a stay that would be pressed and is left out; ``left_x``, …, the force that the bars at the
    point leave to others."""
    rows = list[list[object]]()
    for (case, reactions), (vertex, own) in product(cases, at_points(model.bars).items()):
        directions, force = np.array([bar.direction for bar in own]), reactions[vertex]
        stays = np.array([bar.kind == "stay" for bar in own])
        all_of_them = np.linalg.lstsq(directions.T, force, rcond=None)[0]
        pressed = (stays & (all_of_them < -LEAST * np.linalg.norm(force))).any()
        forces = lsq_linear(directions.T, force, (np.where(stays, 0.0, -np.inf), np.inf), method="bvls").x
        for bar, N, stay in zip(own, forces.tolist(), stays.tolist(), strict=True):
            profile, strength = bar.member.profile, bar.member.strength or math.nan
            stress, EI = N / profile.area, bar.member.material.young * min(profile.moments)
            euler = math.nan if stay else math.pi**2 * EI / bar.length**2
            row = [case, bar.name, bar.kind, *bar.points[0], bar.length, N, stress, abs(stress) / strength]
            row += [euler, euler / -N if N < 0.0 else math.nan, pressed and stay and N <= 0.0]
            rows.append([*row, *(force - forces @ directions)])
    return pd.DataFrame(rows, columns=COLUMNS)


def column_answers(model: StructuralModel, table: pd.DataFrame, units: Units) -> list[str]:
    """A line for each column that buckles and stay that is slack, in the worst case, and each force left."""
    lines, force = list[str](), units.behind("force")
    for bar in model.bars:
        own = table[table["member"] == bar.name]
        row = own.iloc[int(own["N"].to_numpy().argmin())]
        if own["slack"].any():
            cases = ", ".join(own["case"][own["slack"]])
            text = f"{cases}: {bar.name} is slack and left out, as a stay can only pull"
            lines.append(text + "; move its anchor, or make it a column" * bool(own["slack"].all()))
        if row["euler_over"] < 1.0:
            thrust = f"{row['case']}: {bar.name} is pressed with {-row['N']:.3g}{force}"
            stiffer = f"it needs {1.0 / row['euler_over']:.2g} times its E I, without any safety"
            lines.append(f"{thrust} and buckles under {row['euler']:.3g}{force}; {stiffer}")
        for _, worst in own[own["utilisation"] > 1.0].nlargest(1, "utilisation").iterrows():
            used = f"{worst['utilisation']:.2g} times the stress of its strength"
            lines.append(f"{worst['case']}: {bar.name} has {used}")
    for _, own in table.groupby([*"xyz"], sort=False):
        left = own[["left_x", "left_y", "left_z"]].to_numpy()
        sizes = np.linalg.norm(left, axis=1)
        far = int(sizes.argmax())
        case, N, names = own["case"].iloc[far], own["N"].iloc[far], list(dict.fromkeys(own["member"]))
        if sizes[far] > LEAST * (np.abs(own["N"]).max() + sizes[far]):
            text = f"{case}: across {' and '.join(names)} {sizes[far]:.3g}{force} are left,"
            text += f" {_vector(left[far])};"
            bar = next(bar for bar in model.bars if bar.name == names[0])
            all_of_it, normal = N * bar.direction + left[far], np.array(model.surface.plane.normal)
            drop, rate = normal @ (bar.points[1] - bar.points[0]), normal @ all_of_it
            if len(names) > 1 or drop * rate == 0.0 or N >= 0.0:
                lines.append(f"{text} add a stay, or clamp the column's foot")
            else:  # where a column alone would have to stand
                foot = _vector(bar.points[0] + drop / rate * all_of_it)
                lines.append(f"{text} with its foot at {foot} it would carry all; or add stays")
    return lines


def column_text(model: StructuralModel, table: pd.DataFrame, units: Units) -> str:
    """The main columns of the table, and the answers, a line each."""
    shown = table[["case", "member", "length", "N", "stress", "utilisation", "euler", "euler_over"]]
    shown = shown.dropna(axis=1, how="all")
    text = shown.to_string(index=False, float_format="{:.4g}".format, na_rep="-")
    return "\n".join([text, *column_answers(model, table, units)])


def _vector(value: Floats) -> str:
    return point_text(np.array([float(f"{c:.3g}") + 0.0 for c in value]))


def drawn_members(model: StructuralModel) -> tuple[PlacedMember, ...]:
    """All members of a model but its surface's own cables, as files, drawings and the page have them: with
    their forces at rest where the surface is certified.

    >>> from pcmc import Material, Member, Profile
    >>> from pcmc.plan import Plan
    >>> hall = Plan([[0, 0], [4, 0], [4, 2], [0, 2]], [[[2, 0], [2, 2]]], edge_length=0.5, tension=2.0)
    >>> arch = Member("wall 1", Profile.tube(0.1, 0.005), Material(2.1e8))
    >>> model = StructuralModel(hall.surface(), Material(5e5), 1e-3, members=[arch], anyway=True)
    >>> [(one.name, one.kind, one.wall, one.forces) for one in drawn_members(model)]
    [('wall 1', 'beam', 'wall 1', None)]
    """
    members = *model.lines, *model.bars
    if not model.certificate.certified:
        return members
    found = {beam.line.name: beam.within[:, 0] for beam in members_at_rest(model)}
    found |= {cable.name: pull_along(model.standing, cable, cable.edges) for cable in model.standing.cables}
    found |= {str(name): own["N"].to_numpy() for name, own in columns_at_rest(model).groupby("member")}
    forces = {name: (float(N.min()), float(N.max())) for name, N in found.items()}
    return tuple(replace(member, forces=forces.get(member.name)) for member in members)
