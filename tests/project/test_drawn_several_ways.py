"""One roof, its project written several ways: figures, cloth, panels and load cases are the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import tomlkit
from nightly import night_but

from pcmc import project

Text = dict[str, Any]
Numbers = dict[tuple[str, ...], np.ndarray]
# a patch that is heavy in the form, too: what both weights do is compared
pytestmark = pytest.mark.filterwarnings("ignore:.* comes on top:pcmc.base.errors.LoadWarning")

CIRCLE = {"centre": [9.5, 4.0], "radius": 1.0}
HALL: Text = {
    "units": "m",
    "force": "kN",
    "plan": {
        "edge_length": 1.0,
        "outline": [[0, 0], [12, 0], [12, 6], [8, 9], [0, 9]],
        "dividers": [
            {"curve": [[7, 0], [5, 9]], "wall": 0.7},
            {"curve": [[0, 4.5], [6, 4.5]], "cable": 0.5, "name": "tie"},
        ],
        "holes": [{"curve": {"circle": CIRCLE}}],
        "patches": {
            "north": {"tension": 2.0, "pressure": 0.4, "weight": 0.02, "at": [2, 7]},
            "south": {"tension": 2.0, "pressure": 0.4, "at": [2, 2]},
            "east": {"tension": 2.2, "pressure": 0.35, "snow": 0.05, "at": [11, 2]},
        },
    },
    "structure": {
        "young": 5e5,
        "thickness": 0.001,
        "density": 1.2,
        "cable_area": 1e-4,
        "snow": 0.05,
        "wind": {"north": 0.1, "east": -0.05},
        "combinations": {"uls": {"form": 1.0, "snow": 1.5, "wind": 0.9}},
        "zones": [{"case": "drift", "snow": 0.05, "area": [[4, 0], [8, 0], [8, 9], [4, 9]]}],
    },
    "pattern": {"width": 2.5, "allowance": 0.03},
    "output": {"pattern": ["cloth.csv"], "panels": "panels.csv", "tolerance": 0.01},
}
PLACES = ("outline", "curve", "centre", "area", "at", "mirrors")


def moved(value: Any, place: Callable[[list[float]], list[float]], inside: bool = False) -> Any:
    """A project, or a part of it, with all its points in the plan elsewhere."""
    if isinstance(value, dict):
        return {key: moved(part, place, inside or key in PLACES) for key, part in value.items()}
    if not isinstance(value, list):
        return value
    if inside and all(isinstance(number, int | float) for number in value):
        return place(value)
    return [moved(part, place, inside) for part in value]


def begun_elsewhere(hall: Text) -> Text:
    hall["plan"]["outline"] = hall["plan"]["outline"][2:] + hall["plan"]["outline"][:2]
    return hall


def turned_round(hall: Text) -> Text:
    hall["plan"]["outline"].reverse()
    hall["plan"]["dividers"][0]["curve"].reverse()
    hall["plan"]["dividers"][1]["curve"].reverse()
    return hall


def patches_in_another_order(hall: Text) -> Text:
    hall["plan"]["patches"] = dict(reversed(hall["plan"]["patches"].items()))
    return hall


def higher(hall: Text) -> Text:
    hall["plan"]["plane"] = {"point": [0.0, 0.0, 3.0]}
    return hall


def far_away(hall: Text) -> Text:
    return moved(hall, lambda p: [p[0] + 50.0, p[1] - 30.0])


def turned(hall: Text) -> Text:
    c, s = np.cos(0.7), np.sin(0.7)
    return moved(hall, lambda p: [float(c * p[0] - s * p[1]), float(s * p[0] + c * p[1])])


def in_a_mirror(hall: Text) -> Text:
    return moved(hall, lambda p: [-p[0], p[1]])


def in_millimetres(hall: Text) -> Text:
    """With forces in N: a pressure of 1 kN/m² is 0.001 N/mm², a tension of 1 kN/m is 1 N/mm."""
    hall = moved(hall, lambda p: [1000.0 * p[0], 1000.0 * p[1]]) | {"units": "mm", "force": "N"}
    plan, structure = hall["plan"], hall["structure"]
    plan["edge_length"] *= 1000.0
    plan["holes"][0]["curve"]["circle"]["radius"] *= 1000.0
    plan["dividers"][1]["cable"] *= 1000.0
    for patch in plan["patches"].values():
        patch |= {key: 1e-3 * patch[key] for key in ("pressure", "weight", "snow") if key in patch}
    structure |= {"young": 5e2, "thickness": 1.0, "density": 1.2e-9, "cable_area": 100.0, "snow": 5e-5}
    structure["wind"] = {"north": 1e-4, "east": -5e-5}
    structure["zones"][0]["snow"] = 5e-5
    hall["pattern"] = {"width": 2500.0, "allowance": 30.0}
    hall["output"]["tolerance"] = 10.0
    return hall


WAYS = (
    begun_elsewhere,
    turned_round,
    patches_in_another_order,
    higher,
    far_away,
    turned,
    in_a_mirror,
    in_millimetres,
)
# m and kN of what a file calls a length, an area, … where lengths are in mm and forces in N
POWERS = {
    "length": (1, 0),
    "area": (2, 0),
    "volume": (3, 0),
    "force": (0, 1),
    "per length": (-1, 1),
    "pressure": (-2, 1),
    "energy": (1, 1),
}
FIGURES = {
    "apex": "length",
    "rise": "length",
    "area": "area",
    "volume": "volume",
    "reaction per length": "per length",
    "tension": "per length",
    "pressure": "pressure",
    "net pressure": "pressure",
    "snow": "pressure",
    "weight": "pressure",
    "energy": "energy",
    "load": "force",
    "reaction": "force",
}
COLUMNS = {
    "cloth.csv": {"length": "length", "area": "area", "cut_area": "area", "strain_rms": ""},
    "cloth-seams.csv": {"length": "length", "cut_length": "length"},
    "panels-families.csv": {"count": "", "area": "area"},
    "roof-cases.csv": {
        "share": "",
        "taut": "",
        "down": "length",
        "least_force": "per length",
        "largest_force": "per length",
        "force_z": "force",
    },
    "roof-patches.csv": {"least_force": "per length", "mean_force": "per length"},
    "roof-supports.csv": {"length": "length", "force_z": "force"},
    "roof-cables.csv": {"least": "force"},
}


def numbers(folder: Path, text: Text) -> Numbers:
    """What a project's run finds and writes, in m and kN: figures, and the extremes and sums of columns."""
    folder.mkdir()
    (folder / "roof.toml").write_text(tomlkit.dumps(text), encoding="utf-8")
    outcome = project.run(folder / "roof.toml")
    unit = (1e-3, 1e-3) if text["units"] == "mm" else (1.0, 1.0)

    def factor(kind: str) -> float:
        length, force = POWERS.get(kind, (0, 0))
        return float(unit[0] ** length * unit[1] ** force)

    return dict(_numbers(folder, outcome, factor))


def _numbers(folder: Path, outcome: Any, factor: Callable[[str], float]) -> Iterator[tuple[Any, np.ndarray]]:
    for figure in outcome.figures:
        if figure.value is None:
            continue
        kind = FIGURES.get(figure.quantity, "force" if figure.owner == "cable" else "")
        yield (figure.quantity, figure.of), np.array([figure.value * factor(kind)])
    for file in sorted(folder.glob("*.csv")):
        for column, kind in COLUMNS.get(file.name, {}).items():
            values = pd.read_csv(file)[column].dropna().to_numpy() * factor(kind)
            yield (file.name, column), np.array([values.min(), values.max(), values.sum()])


@pytest.fixture(scope="module")
def hall(tmp_path_factory) -> Callable[[bool], Numbers]:
    known: dict[bool, Numbers] = {}

    def found(analysed: bool) -> Numbers:
        if analysed not in known:
            known[analysed] = numbers(tmp_path_factory.mktemp("hall") / "roof", written(HALL, analysed))
        return known[analysed]

    return found


def written(text: Text, analysed: bool) -> Text:
    text = deepcopy(text)
    if analysed:
        text["structure"]["run"] = True
        text["output"]["structure"] = "roof.inp"
    return text


def compare(found: Numbers, expected: Numbers, near: float) -> None:
    assert found.keys() == expected.keys()
    for what, values in expected.items():
        largest = np.abs(values).max()
        assert np.abs(found[what] - values).max() <= near * largest + 1e-9, (what, found[what], values)


@pytest.mark.parametrize("analysed", night_but([False, True], False))
@pytest.mark.parametrize("way", night_but(WAYS, in_millimetres, turned_round))
def test_it_is_the_same_roof(hall, tmp_path, monkeypatch, way, analysed):
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    found, expected = numbers(tmp_path / "roof", way(written(HALL, analysed))), dict(hall(analysed))
    compare(found, expected, 0.02)  # begun elsewhere, triangles are others


SYMMETRIC: Text = HALL | {
    "plan": {
        "edge_length": 0.5,
        "outline": [[0, 0], [12, 0], [12, 8], [0, 8]],
        "dividers": [{"curve": [[0, 4], [12, 4]], "wall": 0.7, "name": "wall"}],
        "holes": [{"curve": {"circle": {"centre": [x, 2.0], "radius": 0.9}}} for x in (3.0, 9.0)],
        "patches": {
            "south": {"tension": 2.0, "pressure": 0.4, "weight": 0.02, "at": [2, 3.5]},
            "north": {"tension": 2.2, "pressure": 0.35, "snow": 0.05, "at": [2, 7]},
        },
    },
    "structure": {key: value for key, value in HALL["structure"].items() if key != "cable_area"}
    | {"wind": {"south": 0.1}, "zones": [{"case": "drift", "snow": 0.05, "patches": ["north"]}]},
}


def half(whole: Text) -> Text:
    plan = whole["plan"]
    plan["outline"] = [[0, 0], [6, 0], [6, 8], [0, 8]]
    plan["mirrors"] = [[[6, 0], [6, 8]]]
    plan["dividers"][0]["curve"] = [[0, 4], [6, 4]]
    del plan["holes"][1]
    whole["output"]["whole"] = True
    return whole


@pytest.mark.parametrize("analysed", night_but([False, True], False))
def test_a_half_with_its_image_is_the_whole(tmp_path, monkeypatch, analysed):
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    expected = numbers(tmp_path / "whole", written(SYMMETRIC, analysed))
    found = numbers(tmp_path / "half", half(written(SYMMETRIC, analysed)))
    of_panels = {("panels-families.csv", "count"), ("panels-families.csv", "area")}  # other triangles
    of_strips = {what for what in expected if what[0].startswith("cloth")}  # other seams
    for what in of_panels | of_strips:
        del found[what], expected[what]
    compare(found, expected, 0.03)
