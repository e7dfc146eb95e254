"""One roof, whichever way it goes: what is written, shown and printed is read back and compared.

A cell is a project and a way. Its numbers are those of the roof that ``pcmc.project.designed`` gives, in
metres and kilonewtons.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asking import Client
from many_projects import KILONEWTONS, METRES, PROJECTS, draw_plan, write_bare_mesh
from printed import words_of

import pcmc
from pcmc import cli, explore, io, project
from pcmc.base.units import Units
from pcmc.explore.roof import read_roof
from pcmc.surface import Surface

DXF = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m"}
TEXT = 2e-3  # relative: of a number printed with four digits, or with three decimals
Facts = dict[str, float]


# -- numbers of a surface, by formulas of this file ------------------------------------------------------


def facts_of(surface: Surface, units: Units) -> Facts:
    """Heights, areas, volumes and loads of a surface, in metres and kilonewtons."""
    length, force = METRES[units.length], KILONEWTONS[units.force]
    X, found = surface.vertices * length, Facts()
    corner = X[surface.faces]
    vector = 0.5 * np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    prism = vector[:, 2] * corner[:, :, 2].mean(axis=1)
    lift = np.zeros(3)
    for k, patch in enumerate(surface.patches):
        own = surface.patch_of_face == k
        area = np.linalg.norm(vector[own], axis=1).sum()
        found[f"apex {patch.name}"] = float(corner[own][:, :, 2].max())
        found[f"area {patch.name}"] = float(area)
        found[f"tension {patch.name}"] = patch.tension * force / length
        found[f"pressure {patch.name}"] = patch.pressure * force / length**2
        found[f"snow {patch.name}"] = patch.snow * force / length**2
        found[f"weight {patch.name}"] = patch.weight * force / length**2
        lift += (patch.pressure - patch.snow) * force / length**2 * vector[own].sum(axis=0)
        lift[2] -= patch.weight * force / length**2 * area
        if surface.roof[k]:
            found["roof area"] = found.get("roof area", 0.0) + float(area)
            found["volume"] = found.get("volume", 0.0) + float(prism[own].sum())
    for cable in surface.cables:
        found[f"cable {cable.name}"] = cable.tension * force
    found["apex"] = max(value for name, value in found.items() if name.startswith("apex "))
    found["load"] = float(lift[2])
    return found


@dataclass(frozen=True)
class Roof:
    """A project on the disk, and the roof that it gives."""

    path: Path
    outcome: project.Outcome
    facts: Facts

    @property
    def units(self) -> Units:
        return self.outcome.units


def written(surface: Surface, units: Units, loads: bool = True) -> Facts:
    """The facts of a surface that was read back; without ``loads`` its shape alone."""
    found = facts_of(surface, units)
    shape = ("apex", "area", "volume", "roof area")
    return {name: x for name, x in found.items() if loads or (name.startswith(shape) and " wall" not in name)}


# -- ways ------------------------------------------------------------------------------------------------


def run(*words: object) -> None:
    """A command, which must end well."""
    assert cli.main([str(word) for word in words]) == 0


def solved(roof: Roof) -> Facts:
    """pcmc solve"""
    run("solve", roof.path, "-o", "solved.pcmc", "--no-mesh-check")
    surface, data = io.read_bare("solved.pcmc")
    return written(surface, data.units)


def converted(suffix: str) -> Callable[[Roof], Facts]:
    """pcmc convert, and the file read again; formats without a unit are read in the project's."""

    def way(roof: Roof) -> Facts:
        name = f"converted{suffix}"
        run("convert", roof.path, name)
        surface, data = io.read_bare(name)
        length = data.units.length or roof.units.length
        units = Units(length, data.units.force or roof.units.force)
        if suffix == ".stl":
            return {name: written(surface, units, loads=False)[name] for name in ("apex",)}
        found = written(surface, units)
        lost = io.FORMATS[suffix].loses
        left_out = {"weights": "weight", "snow": "snow", "cables": "cable"}
        return {n: x for n, x in found.items() if not any(n.startswith(left_out.get(p, "-")) for p in lost)}

    return way


def certified(roof: Roof, capsys: Any) -> Facts:
    """pcmc certify, as it is printed."""
    run("certify", roof.path, *(["--whole"] if roof.outcome.unfold else []))
    printed = capsys.readouterr().out
    length, force = METRES[roof.units.length], KILONEWTONS[roof.units.force]
    volume = re.search(r"^ +volume  ([-\d.e+]+) (\S+)$", printed, re.M)
    load = re.search(r"^ +load, reactions  ([-\d.e+]+) (\S+), ([-\d.e+]+)", printed, re.M)
    assert volume is not None
    assert load is not None
    assert volume[2] == f"{roof.units.length}³"
    assert load[2] == roof.units.force
    return {
        "volume": float(volume[1]) * length**3,
        "load": float(load[1]) * force,
        "reaction": float(load[3]) * force,
    }


def reported(roof: Roof) -> Facts:
    """pcmc report, as the PDF shows it."""
    run("report", roof.path, "-o", "report.pdf", "--no-mesh-check")
    text = "\f".join(words_of("report.pdf"))
    labels = {
        "apex": "highest point above the plane",
        "roof area": "area of the roof",
        "volume": "volume below it",
    }
    labels |= {"load": "pressure, snow and weight, upwards", "reaction": "all reactions, upwards"}
    length, force = METRES[roof.units.length], KILONEWTONS[roof.units.force]
    power = {"apex": length, "roof area": length**2, "volume": length**3, "load": force, "reaction": force}
    found = {name: re.search(rf"^ *{label} +([-\d.e+]+) (\S+)", text, re.M) for name, label in labels.items()}
    return {name: float(match[1]) * power[name] for name, match in found.items() if match is not None}


def drawn(roof: Roof) -> Facts:
    """pcmc draw, as a program for drawings reads it."""
    import ezdxf

    run("draw", roof.path, "-o", "sheets.dxf")
    document = ezdxf.readfile("sheets.dxf")
    length = METRES[DXF[document.header["$INSUNITS"]]]
    heights = [
        vertex[2]
        for entity in document.modelspace()
        if entity.dxftype() in ("POLYLINE", "MESH", "3DFACE")
        for vertex in _corners(entity)
    ]
    return {"apex": max(heights) * length}


def _corners(entity: Any) -> list[Any]:
    if entity.dxftype() == "MESH":
        return list(entity.vertices)
    if entity.dxftype() == "3DFACE":
        return list(entity.wcs_vertices())
    return [vertex.dxf.location for vertex in entity.vertices]


def scheduled(roof: Roof) -> Facts:
    """pcmc panels: the areas of all panels."""
    run("panels", roof.path, "--tolerance", 0.01 / METRES[roof.units.length], "-o", "panels.csv")
    with open("panels.csv", encoding="utf-8") as file:
        areas = [float(row["area"]) for row in csv.DictReader(file)]
    return {"roof area": sum(areas) * METRES[roof.units.length] ** 2}


def modelled(roof: Roof) -> Facts:
    """pcmc structure: nodes, and the load of the first step on the elements."""
    length, force = METRES[roof.units.length], KILONEWTONS[roof.units.force]
    cable = ["--cable-area", 1e-4 / length**2] if roof.outcome.surface.cables else []
    young = 1e6 / (force / length**2)
    run("structure", roof.path, "-o", "model.inp", "--young", young, "--thickness", 1e-3 / length, *cable)
    text = Path("model.inp").read_text(encoding="utf-8")
    nodes = re.search(r"^\*NODE[^\n]*\n((?:\s*\d+,[^\n]*\n)+)", text, re.M)
    assert nodes is not None
    heights = [float(line.split(",")[3]) for line in nodes[1].splitlines()]
    return {"apex": max(heights) * length}


def swept(roof: Roof) -> Facts:
    """pcmc sweep over one value, which is the project's own."""
    name = "roof.tension=3.0" if roof.path.stem == "mesh" else f"plan.edge_length={_edge(roof)}"
    run("sweep", roof.path, name, "--csv", "sweep.csv", "--all", "--workers", 1)
    with open("sweep.csv", encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    row = {name.partition(" [")[0]: text for name, text in row.items()}
    length = METRES[roof.units.length]
    found = {f"apex {p.name}": float(row[f"{p.name}.apex"]) * length for p in _roofs(roof)}
    return found | {
        "volume": float(row["volume"]) * length**3,
        "roof area": float(row["area"]) * length**2,
    }


def _edge(roof: Roof) -> float:
    plan = project.load(roof.path).plan
    assert plan is not None
    return plan.edge_length


def _roofs(roof: Roof) -> list[pcmc.Patch]:
    surface = roof.outcome.surface
    return [patch for patch, is_roof in zip(surface.patches, surface.roof, strict=True) if is_roof]


def in_compas(roof: Roof) -> Facts:
    """The meshes of COMPAS, and back."""
    from pcmc.compas import from_meshes, to_meshes

    return written(from_meshes(to_meshes(roof.outcome.shown.surface)), roof.units)


def on_the_page(roof: Roof) -> Facts:
    """The page, as its browser learns it."""
    opened = read_roof(roof.path)
    explorer = explore.start(opened)
    try:
        header, _ = Client(explorer).ask("/api/open")
    finally:
        explorer.close()
    length, force = METRES[roof.units.length], KILONEWTONS[roof.units.force]
    power = {"apex": length, "area": length**2, "volume": length**3, "tension": force / length}
    power |= {
        "pressure": force / length**2,
        "snow": force / length**2,
        "weight": force / length**2,
        "force": force,
    }
    found = Facts()
    rooms = {room.name for room in roof.outcome.surface.rooms}
    for row in header["figures"]:
        name = (
            {"area": "roof area"}.get(row["quantity"], row["quantity"]) if not row["of"] else row["quantity"]
        )
        if row["quantity"] in power and row["value"] is not None and row["of"] not in rooms:
            key = f"{'cable' if name == 'force' else name} {row['of']}".strip()
            found[key] = row["value"] * power[row["quantity"]]
    assert header["units"]["length"] == roof.units.length
    assert header["whole_files"] == roof.outcome.unfold
    return {key: value for key, value in found.items() if not key.startswith("volume ")}


def saved_from_the_page(roof: Roof) -> Facts:
    """Saved from the page under another name, and solved."""
    explorer = explore.start(read_roof(roof.path))
    try:
        client = Client(explorer)
        header, _ = client.ask("/api/open")
        client.ask(f"/api/{header['session']}/save", {"name": "variant", "replace": False})
    finally:
        explorer.close()
    variant = project.designed(roof.path.with_name("variant.toml"))
    assert variant.good
    return facts_of(variant.shown.surface, variant.units)


FORMATS = [name for name, form in io.FORMATS.items() if form.reads and name not in (".dmp", ".gltf", ".vtu")]
WAYS: dict[str, Callable[..., Facts]] = {
    "solve": solved,
    **{f"convert {suffix}": converted(suffix) for suffix in FORMATS},
    "certify": certified,
    "report": reported,
    "sheets": drawn,
    "schedule": scheduled,
    "structure": modelled,
    "sweep": swept,
    "compas": in_compas,
    "page": on_the_page,
    "save": saved_from_the_page,
}
SINGLE = dict.fromkeys((f"convert {suffix}" for suffix in (".glb", ".stl", ".3dm", ".ifc")), 1e-6)
PRINTED = {"certify": 1e-5, "report": TEXT, "sheets": 1e-6, **SINGLE}
"""The relative rounding of ways whose numbers are not exact."""


CELLS = [
    pytest.param(name, way, marks=[pytest.mark.nightly] if (row + column) % 13 else [])
    for row, name in enumerate(PROJECTS)
    for column, way in enumerate(WAYS)
]
"""Every project by every way, most of them at night: by day each way takes every thirteenth project."""


@pytest.fixture(scope="module")
def roofs(tmp_path_factory) -> Callable[[str], Roof]:
    """Each project's roof, designed once."""
    known: dict[str, Roof] = {}

    def roof(name: str) -> Roof:
        if name not in known:
            folder = tmp_path_factory.mktemp(name.replace(" ", "-"))
            draw_plan(folder / "plan.dxf")
            write_bare_mesh(folder / "bare.obj")
            path = folder / f"{name.replace(' ', '-')}.toml"
            path.write_text(PROJECTS[name], encoding="utf-8")
            outcome = project.designed(path)
            assert outcome.good, outcome
            known[name] = Roof(path, outcome, facts_of(outcome.shown.surface, outcome.units))
        return known[name]

    return roof


@pytest.fixture
def folder(tmp_path, tmp_path_factory, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path_factory.getbasetemp() / "matrix-cache"))
    return tmp_path


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FileWarning")
@pytest.mark.parametrize(("name", "way"), CELLS)
def test_it_is_the_same_roof(name, way, roofs, folder, capsys):
    roof = roofs(name)
    found = WAYS[way](roof, capsys) if way == "certify" else WAYS[way](roof)
    assert found
    expected = roof.facts | {"reaction": -roof.facts["load"]}
    if way == "page":  # which draws the whole and says that its numbers are those of the piece
        expected = facts_of(roof.outcome.surface, roof.units)
    scale = max(map(abs, expected.values()))
    for fact, value in found.items():
        if fact == "reaction":  # what the mesh leaves along the sheets is no part of it
            assert value == pytest.approx(expected[fact], rel=0.03)
            continue
        near = PRINTED.get(way, 1e-9)
        assert value == pytest.approx(expected[fact], rel=near, abs=1e-12 * scale + near * 1e-3), fact
    missing = (
        {n for n in expected if n.startswith(("snow ", "cable ", "weight "))} if way == "solve" else set()
    )
    assert missing <= set(found)


def test_the_number_of_cells():
    assert len(PROJECTS) * len(WAYS) >= 12 * 15
