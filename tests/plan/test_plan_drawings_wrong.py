"""Drawings that are no plan: refused with layer, entity and place, in one line and bounded time."""

from __future__ import annotations

import math

import drawn
import numpy as np
import pytest
from drawn import BOX, drawing
from refusals import refused

from pcmc import project
from pcmc.base.errors import FileError, OptionError, PlanError, SurfaceError
from pcmc.plan.drawing import read_drawing
from pcmc.plan.proposal import proposal, proposed
from pcmc.plan.reading_drawings import dxf_entities
from pcmc.plan.strokes import read_strokes

WRONG = {
    "empty": ({"outline": False}, [], "outline", None),
    "only faces": (
        {"outline": False},
        [("3dface", "roof", [(0, 0), (1, 0), (1, 1), (0, 1)])],
        "outline",
        None,
    ),
    "misspelt": ({"outline": False}, [("circle", "outlne", (0, 0), 3)], "outline", None),
    "an open outline": (
        {"outline": False},
        [("lwpolyline", "outline", [*BOX, (0, 0.3)])],
        "layer 'outline'",
        ((0.0, 0.0, 0.0), (0.0, 0.3, 0.0)),
    ),
    "a fork": (
        {"outline": False},
        [("line", "outline", (0, 0), end) for end in ((4, 0), (0, 4), (4, 4))],
        "layer 'outline'",
        (0.0, 0.0, 0.0),
    ),
    "a stray line": ({}, [("line", "outline", (20, 0), (24, 0))], "layer 'outline'", (20.0, 0.0, 0.0)),
    "two outlines": ({}, [("circle", "outline", (5, 3), 1)], "layer 'outline'", None),
    "an open hole": (
        {},
        [("line", "hole a", (2, 2), (3, 3))],
        "layer 'hole a'",
        ((2.0, 2.0, 0.0), (3.0, 3.0, 0.0)),
    ),
    "a leaning mast": ({}, [("line", "mast", (5, 3, 0), (6, 3, 2))], "layer 'mast'", (5.0, 3.0, 0.0)),
    "a height without a number": ({}, [("text", "height", "high")], "layer 'height'", None),
    "a patch without a name": ({}, [("point", "patch", (5, 3))], "layer 'patch'", None),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_drawings_are_refused_with_layer_and_place(tmp_path, case):
    options, calls, what, where = WRONG[case]
    file = drawing(tmp_path, *calls, **options)
    with refused(PlanError, what=what, where=where) as caught:
        read_drawing(file)
    assert str(file) in str(caught.value)


BAD_LINES = {
    "crosses itself": ("lwpolyline", [(2, 0), (8, 6), (8, 0), (2, 6)], (5.0, 3.0)),
    "ends inside": ("line", (5, 0), (5, 5), (5.0, 5.0)),
    "outside": ("line", (25, 0), (25, 6), None),
}


@pytest.mark.parametrize("case", BAD_LINES)
def test_errors_of_the_plan_name_the_layer_and_the_entity(tmp_path, case):
    kind, *arguments, where = BAD_LINES[case]
    file = drawing(tmp_path, (kind, "divider north", *arguments))
    with refused(PlanError, what="divider 'north'", where=where) as caught:
        project.surface_of(project.load(file))
    assert f"layer 'divider north': {'LWPOLYLINE' if kind == 'lwpolyline' else 'LINE'}" in str(caught.value)


def test_a_tension_counts_in_whichever_text_of_a_patch_it_stands(tmp_path):
    stated, bare = ("text", "patch", "nave = 7.5"), ("text", "patch", "nave")
    beside = [("point", "patch nave", (2, 3)), ("line", "divider north", (4, 0), (4, 6))]
    for calls in ([stated, bare], [stated, *beside]):
        plan, chosen = proposal(read_drawing(drawing(tmp_path, *calls)))
        assert {name: patch["tension"] for name, patch in plan["patches"].items()} == {"nave": 7.5}
        assert not chosen.tensions
    with refused(PlanError, what="patch", where="nave"):
        proposed(read_drawing(drawing(tmp_path, stated, ("text", "patch", "nave = 8"))))


def test_names_that_do_not_fit_the_drawing_are_refused(tmp_path):
    file = drawing(tmp_path, ("text", "patch", "nave = 7.5"))
    plan = read_drawing(file)
    assert proposed(plan)["patches"]["nave"]["tension"] == 7.5
    with refused(OptionError, what="patches", where="nve"):
        proposed(plan, {"patches": {"nve": {"tension": 1.0}}})
    with refused(OptionError, what="dividers", found="a"):
        proposed(plan, {"dividers": [{"name": "a", "wall": 1.0}]})
    for line, what in (
        ("gap = 1\noutline = [[0, 0], [1, 0], [0, 1]]", "plan.gap"),
        ('drawing = "../a.dxf"', "plan.drawing"),
    ):
        (tmp_path / "p.toml").write_text(f"[plan]\n{line}\n")
        with refused(FileError, what=what):
            project.load(tmp_path / "p.toml")


def test_without_an_outline_only_layers_without_a_meaning_are_left_out(tmp_path):
    lines = [("circle", "outlin", (4, 3), 9.0), ("line", "divider A", (4, 0), (4, 6))]
    file = drawing(tmp_path, *lines, outline=False)
    with pytest.raises(PlanError, match=r"left out: 'outlin' \(1 entity, did you mean 'outline'\?\); under"):
        read_drawing(file)
    file = drawing(tmp_path, lines[1], outline=False)
    with pytest.raises(
        PlanError, match=r"no curve on a layer 'outline'; all are on 'divider A'; draw the whole"
    ):
        read_drawing(file)


def test_an_edge_that_is_missing_is_no_gap_to_close(tmp_path):
    """A gap as wide as a line swallows it: with ``gap = 9.1`` the mirror vanished without a word."""
    lines = [("lwpolyline", "outline", [(6, 0), (0, 0), (0, 9), (6, 9)]), ("line", "mirror", (6, 0), (6, 9))]
    file = drawing(tmp_path, *lines, outline=False)
    with refused(PlanError, what="layer 'outline'", found=9.0) as caught:
        read_drawing(file)
    assert str(caught.value).endswith(
        "draw what is missing; edges on layers 'mirror', 'free' and 'cable' are drawn on 'outline', too"
    )
    with refused(OptionError, what="gap", found=9.1):
        read_drawing(file, gap=9.1)


def test_a_drawing_without_lines_says_what_it_has(tmp_path):
    file = drawing(tmp_path, ("hatch", "outline"), outline=False)
    with pytest.raises(PlanError, match="has no lines, only 1 HATCH; draw those of the plan"):
        read_drawing(file)


def test_hostile_drawings_are_refused_in_one_line(tmp_path):
    file = tmp_path / "a.dxf"
    for content in (
        b"",
        b"\x00" * 3000,
        b"0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n",
        b"AutoCAD Binary DXF\r\n\x1a\x00",
    ):
        file.write_bytes(content)
        with pytest.raises((FileError, PlanError)) as caught:
            read_drawing(file)
        assert "\n" not in str(caught.value)
    far = drawing(tmp_path, ("line", "divider a", (1e300, 0), (5, 6)))
    with refused(FileError, where="divider a"):
        read_drawing(far)


def test_a_line_far_longer_than_the_plan_is_refused(tmp_path):
    loaded = project.load(drawing(tmp_path, ("line", "divider a", (5, 0), (5, 5e9))))
    with refused(PlanError, what="divider 'a'", found=5e9):
        project.surface_of(loaded)


def test_too_many_lines_and_patches_are_counted_with_the_name_of_the_file(tmp_path):
    loose = [("line", "divider", (0.001 * k, 2), (0.001 * k, 4)) for k in range(1, 1002)]
    path = drawing(tmp_path, *loose)
    with refused(PlanError, what="dividers", found=1001) as caught:
        read_drawing(path, gap=1e-4)
    assert str(caught.value).startswith(f"{path}: dividers: 1001 are too many")
    across = [("line", "divider", (0.2 * k, 0), (0.2 * k, 6)) for k in range(1, 50)]
    along = [("line", "divider", (0, 0.12 * k), (10, 0.12 * k)) for k in range(1, 50)]
    path = drawing(tmp_path, *across, *along)
    with refused(PlanError, what="patches", found=2500) as caught:
        proposed(read_drawing(path))
    assert str(caught.value).startswith(f"{path}: patches: 2500 are too many")


def test_blocks_of_blocks_of_blocks_end(tmp_path):
    file = tmp_path / "a.dxf"
    document, space = drawn.new()
    inner = document.blocks.new("B0")
    inner.add_line((0, 0), (1, 0))
    for level in range(1, 8):  # ten copies of ten copies ...
        block = document.blocks.new(f"B{level}")
        for k in range(10):
            block.add_blockref(f"B{level - 1}", (k, 0))
    space.add_blockref("B7", (0, 0), dxfattribs=drawn.on("outline"))
    document.saveas(file)
    with refused(FileError, what=str(file)) as caught:
        read_strokes(file)
    assert "entities" in str(caught.value)


@pytest.mark.parametrize(("levels", "found"), [(8, {"LINE"}), (9, set())])
def test_blocks_in_blocks_are_read_to_a_depth(tmp_path, levels, found):
    document, space = drawn.new()
    document.blocks.new("B0").add_line((0, 0), (1, 0))
    for level in range(1, levels):
        document.blocks.new(f"B{level}").add_blockref(f"B{level - 1}", (0, 0))
    space.add_blockref(f"B{levels - 1}", (0, 0), dxfattribs=drawn.on("outline"))
    document.saveas(tmp_path / "a.dxf")
    contents = dxf_entities(str(tmp_path / "a.dxf"))
    assert {entity["kind"] for entity in contents["entities"]} == found
    assert bool(contents["others"]) == (not found)


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.FileWarning")
def test_flipped_bits_of_a_drawing_raise_our_errors_only(tmp_path):
    data = drawn.corner(tmp_path / "corner.dxf").read_bytes()
    begin = data.index(b"ENTITIES")
    end = data.index(b"ENDSEC", begin)
    random = np.random.default_rng(5)
    file = tmp_path / "flipped.dxf"
    outcomes = set()
    for _ in range(25):
        flipped = bytearray(data)
        for place in random.integers(begin, end, 3):
            flipped[place] ^= 1 << int(random.integers(8))
        file.write_bytes(bytes(flipped))
        try:
            project.surface_of(project.load(file))
            outcomes.add("read")
        except (FileError, PlanError, OptionError, SurfaceError) as error:
            outcomes.add("refused" if "\n" not in str(error) else "in several lines")
    assert outcomes == {"read", "refused"}


@pytest.mark.parametrize(("start", "end"), [(0.0, math.inf), (-math.inf, 1.0), (math.nan, 1.0)])
def test_an_ellipse_without_ends_is_refused_in_one_line(tmp_path, start, end):
    path = drawing(tmp_path, ("ellipse", "support", (3, 3), (2, 0), 0.5, start, end))
    with refused(FileError, what=str(path)) as caught:
        read_drawing(path)
    assert "its ends are no angles; draw it again" in str(caught.value)
