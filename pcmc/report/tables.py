"""The blocks of a report, and the numbers of a roof as tables of texts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ..accuracy import MeshCheck
from ..base.units import Units
from ..certificate import Certificate
from ..certificate.quantities import Figure, dimension_of
from ..certificate.tables import PLACES
from ..drawings.sheet import DIGITS, column
from ..panelling import Panels
from ..surface import Surface
from .plan import PaperPlan

MIDDLE = "middle_x middle_y middle_z"
MOST_FAMILIES = 40  # rows of the panel schedule; the table of panels has all of them


class Heading(NamedTuple):
    """A heading that stays with what follows it, perhaps on a new page."""

    text: str
    new_page: bool = False


class Picture(NamedTuple):
    """A picture across the page, as a PNG file, with its title above it."""

    title: str
    png: bytes


class Table(NamedTuple):
    """A table: its title, the head, the rows, and how many columns at the left are words."""

    title: str
    head: list[str]
    rows: list[list[str]]
    words: int = 1


Columns = dict[str, Iterable[Any]]
Block = str | Heading | Picture | Table | PaperPlan  # of the pages of a report; a text is a paragraph


def one(value: float) -> str:
    """A single number; see ``column``."""
    return column([value])[0]


LISTED = {  # the key figures of a report; those of several walls are added
    ("apex", "roof"): "highest point above the plane",
    ("area", "roof"): "area of the roof",
    ("area", "wall"): "area of walls",
    ("volume", "roof"): "volume below it",
    ("load", "roof"): "pressure, snow and weight, upwards",
    ("reaction", "roof"): "all reactions, upwards",
    ("reaction per length", "roof"): "largest reaction per length",
}


def key_figures(surface: Surface, figures: Sequence[Figure], units: Units) -> Table:
    """Size, height, areas, volume, load, and the largest reaction per length."""
    width, depth, _ = np.ptp(surface.vertices, axis=0).tolist()
    rows = [["size in the plan", f"{one(width)} × {one(depth)} {units.length}"]]
    for (quantity, owner), label in LISTED.items():
        found = (f.value for f in figures if (f.quantity, f.owner) == (quantity, owner))
        if values := [value for value in found if value is not None]:
            rows.append([label, f"{one(sum(values))} {units.behind(dimension_of(quantity)).strip()}"])
    rows.append(["mesh", f"{surface.m} triangles, {surface.n} vertices"])
    return Table("Key figures", [], rows)


def table_of_patches(surface: Surface, certificate: Certificate, units: Units) -> Table:
    """A row per patch: tension, pressure, snow, weight, area, mean curvature and its error."""
    table = certificate.patches.rename(columns={"net": "net_pressure", "mean_H": "mean_curvature"})
    pressures = " ".join(key for key in ("pressure", "snow", "net_pressure") if key in table)
    kinds = {"tension": units.tension, pressures: units.pressure, "area": units.area}
    columns = columns_in(table, kinds | {"mean_curvature": f"1/{units.length}"})
    columns["its largest error"] = map(small, table["variational_max"])
    weights = [patch.weight for patch in surface.patches]
    columns |= {f"weight, {units.pressure}": column(weights)} if any(weights) else {}
    kind = ["wall" if wall else "roof" for wall in surface.walls.tolist()]
    return text_table("Patches", {"patch": table["patch"], "kind": kind}, columns)


def line_tables(certificate: Certificate, units: Units) -> Iterator[Table]:
    """Junctions and supports with their reactions, numbered as in the plan, and how far walls lean."""
    force = units.force or "force"
    if len(table := certificate.junctions):
        columns = columns_in(table, {f"length {MIDDLE}": units.length})
        columns[f"force left, {units.tension}"] = map(small, table["force_left"])
        numbers = [f"J{k + 1}" for k in range(len(table))]
        yield text_table("Junctions", {"": numbers, "between": table["junction"]}, columns)
    if len(table := certificate.leaning):
        columns = {"lean, °": [f"{lean:.1f}" for lean in table["lean"]]}
        columns |= columns_in(table, {"x y z": units.length})
        yield text_table("Walls: the largest angle from the vertical", table[["wall"]], columns)
    if len(table := certificate.supports):
        own = table["name"].where(table["name"] != table["support"], "")
        columns = columns_in(table, {"x y z": units.length})
        columns[f"length, {units.length}"] = column(table["length"].where(table["length"] > 0.0))
        columns |= vectors_of(table, "force", "R", force)
        columns[f"largest, {units.tension}"] = column(table["per_length_max"])
        words = {"": table["support"], "of": own, "kind": table["kind"]}
        yield text_table("Supports and their reactions", words, columns)
        columns = vectors_of(certificate.balance, "force", "F", force)
        columns |= vectors_of(certificate.balance, "moment", "M", f"{force}·{units.length}")
        yield text_table("Balance", {"": certificate.balance["of"]}, columns)


def cable_tables(certificate: Certificate, units: Units) -> Iterator[Table]:
    """The cables with their forces, what holds their ends, and the rooms of prescribed volume."""
    table, force = certificate.cables.rename(columns={"tension": "force"}), units.force or "force"
    if len(table):
        weights = {"weight": units.tension} if "weight" in table else {}
        columns = columns_in(table, {"force": force, **weights, f"length {MIDDLE}": units.length})
        yield text_table("Cables", table[["cable"]], columns)
    if len(table := certificate.cable_ends):
        surface, free = certificate.acting.standing, ~table["held"]
        mirrored = free & surface.held[table["vertex"]]  # it goes on behind a mirror plane
        kinds = np.select([mirrored, free], ["mirror", "free"], "held").tolist()
        words = {"cable": table["cable"], "end": kinds}
        columns = columns_in(table, {"x y z": units.length}) | vectors_of(table, "force", "F", force)
        yield text_table("Ends of cables, and the forces on them", words, columns)
    if len(table := certificate.rooms):
        columns = columns_in(table, {"volume prescribed": units.volume, "pressure": units.pressure})
        yield text_table("Rooms of prescribed volume", table[["room"]], columns)


def target_table(targets: pd.DataFrame, units: Units) -> Table:
    """What was wanted, and what is reached."""
    columns: Columns = {"wanted": map(one, targets["wanted"]), "reached": map(one, targets["value"])}
    columns["unit"] = [units.behind(dimension).strip() for dimension in targets["dimension"]]
    columns["met"] = ["yes" if met else "no" for met in targets["met"]]
    return text_table("Targets", {"quantity": targets.index}, columns)


def mesh_table(check: MeshCheck, units: Units) -> Table:
    """Each quantity with its error bar, and its limit on finer and finer meshes."""
    table = check.table
    columns: Columns = {"on this mesh": map(one, table["value"]), "error bar": map(_bar, table["error"])}
    columns |= {"limit": map(one, table["limit"]), "its error bar": map(_bar, table["limit_error"])}
    columns["unit"] = [units.behind(dimension_of(quantity)).strip() for quantity in table["quantity"]]
    return text_table("", {"quantity": table["quantity"], "of": table["of"]}, columns)


def family_table(schedule: Panels, units: Units) -> Table:
    """The first families of panels, the largest first."""
    table = schedule.families.head(MOST_FAMILIES)
    columns: Columns = {"panels": table["count"], "turned over": table["mirrored"]}
    columns |= columns_in(table, {"a b c": units.length, "area": units.area})
    return text_table("", {"family": [f"F{k}" for k in table["family"]]}, columns)


def text_table(title: str, words: Mapping[str, Any] | pd.DataFrame, columns: Columns) -> Table:
    """A table of columns of texts, those of ``words`` first."""
    every: dict[Any, Any] = {**words, **columns}
    rows = [[*map(str, row)] for row in zip(*every.values(), strict=True)]
    return Table(title, [*every], rows, len(every) - len(columns))


def vectors_of(table: pd.DataFrame, kind: str, letter: str, unit: str) -> Columns:
    """Columns of vectors, with the decimals of their largest component."""
    numbers = table[[f"{kind}_{axis}" for axis in "xyz"]].to_numpy(float)
    texts = np.array(column(numbers.ravel())).reshape(-1, 3).T
    return {f"{letter}{axis}, {unit}": part.tolist() for axis, part in zip("xyz", texts, strict=True)}


def columns_in(table: pd.DataFrame, units: Mapping[str, str]) -> Columns:
    """The columns of a table, by the unit of several names with blanks between them.

    >>> columns_in(pd.DataFrame({"least_force": [1.0, 2.0], "area": [3.0, 4.0]}), {"least_force area": "m"})
    {'least force, m': ['1.000', '2.000'], 'area, m': ['3.000', '4.000']}
    >>> columns_in(pd.DataFrame({"x": [691006.4]}), {"x": "m"})
    {'x, m': ['691006.400']}
    """
    pairs = [(key, unit) for keys, unit in units.items() for key in keys.split()]
    far = {key: 9 for key, _ in pairs if key in PLACES and table[key].abs().max() >= 1e5}  # of a survey
    return {f"{k.replace('_', ' ')}, {unit}": column(table[k], far.get(k, DIGITS)) for k, unit in pairs}


def small(value: float) -> str:
    """The size of an error."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.0e}" if value else "0"


def _bar(value: float) -> str:
    """An error bar, to two digits; nothing for one without bound, and "given" where the value is given."""
    text = f"± {column([value], 2)[0]}" if math.isfinite(value) else "–"
    return text if value else "given"
