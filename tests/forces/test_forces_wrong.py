"""Impossible cables, weights, volumes and mirrors: one line names the mistake and its place."""

from __future__ import annotations

import pytest
from force_cases import BUBBLE_TOML, HALL, SAIL
from refusals import refused

from pcmc import cli, io
from pcmc.base.errors import FileError, OptionError, PlanError
from pcmc.plan import CableLine, Divider, Plan
from pcmc.project import load, run

ENDS = [[0, 0], [10, 0]]
TWO = {"west": {"tension": 3.0}, "east": {"tension": 3.0}}
WRONG = {
    "a cable beside the edges": (
        {"cables": [CableLine([[2, 2], [4, 2]], 3.0)]} | {"tension": 1.0, "pressure": 0.0},
        PlanError,
        "cable 1",
    ),
    "a cable with a negative tension": (
        {"cables": [{"curve": [[0, 0], [10, 0]], "tension": -3.0}], "tension": 1.0},
        OptionError,
        "tension",
    ),
    "an edge with a negative cable": (SAIL | {"cable": -1.0}, OptionError, "cable"),
    "an edge without the tension of its cable": (SAIL | {"cable": None}, OptionError, "cable"),
    "a cable on a fixed edge": ({"cable": 2.0, "tension": 1.0}, OptionError, "edge"),
    "pressure beside a free edge": (SAIL | {"pressure": 1.0, "supports": ENDS}, PlanError, "pressure"),
    "snow beside a free edge": (SAIL | {"snow": 1.0, "supports": ENDS}, PlanError, "snow"),
    "a cable edge that nothing holds": (SAIL | {"supports": []}, PlanError, "supports"),
    "a mast beside its edge": ({"tension": 4.0, "supports": [[10, 3, 2]]}, PlanError, "supports"),
    "a room without a wall": (
        {
            "dividers": [Divider([[4, 0], [4, 6]], wall=False)],
            "patches": TWO | {"west": {"tension": 3.0, "volume": 9.0}},
        },
        PlanError,
        "rooms",
    ),
    "a volume and a pressure": (
        {"patches": {"roof": {"tension": 3.0, "pressure": 1.0, "volume": 9.0}}},
        OptionError,
        "volume",
    ),
    "the volume of a room and a pressure": (
        {
            "patches": TWO | {"west": {"tension": 3.0, "pressure": 2.0}},
            "rooms": {"hall": {"patches": ["west"], "volume": 9.0}},
        },
        OptionError,
        "volume",
    ),
    "two volumes": (
        {
            "patches": {"roof": {"tension": 3.0, "volume": 9.0}},
            "rooms": {"hall": {"patches": ["roof"], "volume": 9.0}},
        },
        OptionError,
        "rooms",
    ),
    "a room of no patch": (
        {"patches": TWO, "rooms": {"hall": {"patches": ["nave"], "volume": 9.0}}},
        OptionError,
        "room 'hall': patch",
    ),
    "a mirror through the plan": ({"tension": 4.0, "mirrors": [[[5, 0], [5, 6]]]}, PlanError, "mirror 1"),
    "a mirror beside the plan": ({"tension": 4.0, "mirrors": [[[11, 0], [11, 6]]]}, PlanError, "mirror 1"),
    "a bent mirror": ({"tension": 4.0, "mirrors": [[[10, 0], [11, 3], [10, 6]]]}, OptionError, "mirror 1"),
    "a weight on no patch": ({"patches": TWO, "weight": 1.0}, OptionError, "weight"),
    "a cable with the name of a patch": (
        {
            "tension": 1.0,
            "cables": [CableLine([[0, 0], [10, 0]], 3.0, "wall 1")],
            "dividers": [[[5, 0], [5, 6]]],
        },
        OptionError,
        "name",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_plans_are_refused_in_one_line(name):
    values, kind, what = WRONG[name]
    with refused(kind, what=what) as caught:
        Plan(HALL, **values).surface()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "options",
    [
        ["--cable", "cable 1=-3"],
        ["--cable", "cable 9=3"],
        ["--cable", "3"],
        ["--volume", "4"],
        ["--volume", "west=4"],
        ["--weight", "wall 1=0.1"],
        ["--whole"],
    ],
)
def test_wrong_values_of_the_command_line_are_refused_in_one_line(folder, capsys, options):
    plan = Plan(HALL, [Divider([[4, 0], [4, 6]], wall=0.0)], patches=TWO)
    io.write("roof.pcmc", plan.surface())
    assert cli.main(["solve", "roof.pcmc", *options]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_wrong_keys_of_a_project_are_refused_with_their_line(folder):
    text = BUBBLE_TOML.replace("volume = 40.0", "volum = 40.0")
    (folder / "roof.toml").write_text(text, encoding="utf-8")
    with refused(FileError, what="plan.patches.dome.volum", where=7):
        load("roof.toml")
    (folder / "roof.toml").write_text(BUBBLE_TOML + "whole = true\n", encoding="utf-8")
    with refused(OptionError, what="whole"):
        run("roof.toml")
    assert not (folder / "bubble.pcmc").exists()
