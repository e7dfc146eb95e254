"""What the layers of a drawing carry: cables, free edges, mirrors, upright walls, raised supports, texts."""

from __future__ import annotations

import drawn
import numpy as np
import pytest
from drawn import BOX, drawing, on
from nightly import night_but
from refusals import refused

from pcmc import project
from pcmc.base.errors import FileWarning, PlanError
from pcmc.plan.drawing import read_drawing
from pcmc.plan.proposal import proposed

rhino3dm = pytest.importorskip("rhino3dm")

LINES = {  # layer: the lines on it, of a hall 10 by 6 with an open east end
    "outline": [
        [(0, 0, 0), (10, 0, 0)],
        [(10, 0, 0), (10, 6, 0)],
        [(10, 6, 0), (0, 6, 0)],
        [(0, 6, 0), (0, 0, 0)],
    ],
    "mirror": [[(0, 0.004, 0), (0, 6, 0)]],
    "cable east": [[(10, 0, 0), (10, 5.996, 0)]],
    "free": [[(4, 6, 0), (6, 6, 0)]],
    "upright hall": [[(5, 0, 0), (5, 3, 0)], [(5, 3, 0), (5, 6, 0)]],
    "cable ridge": [[(0, 3, 0), (5, 3, 0)]],
    "support": [[(1, 0, 2), (4, 0, 2)]],
}


def as_dxf(path):
    document, space = drawn.new()
    for layer, lines in LINES.items():
        for start, end in lines:
            space.add_line(start, end, dxfattribs=on(layer))
    space.add_point((10, 6, 3), dxfattribs=on("mast"))
    document.saveas(path)


def as_rhino(path):
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Meters

    def on_layer(name):
        layer = rhino3dm.Layer()
        layer.Name = name
        attributes = rhino3dm.ObjectAttributes()
        attributes.LayerIndex = model.Layers.Add(layer)
        return attributes

    for layer, lines in LINES.items():
        attributes = on_layer(layer)
        for start, end in lines:
            curve = rhino3dm.LineCurve(rhino3dm.Point3d(*start), rhino3dm.Point3d(*end))
            model.Objects.AddCurve(curve, attributes)
    model.Objects.AddPoint(rhino3dm.Point3d(10, 6, 3), on_layer("mast"))
    model.Write(str(path), 7)


@pytest.mark.parametrize(("name", "write"), [("hall.dxf", as_dxf), ("hall.3dm", as_rhino)])
def test_every_layer_comes_out_of_both_kinds_of_drawings(tmp_path, name, write):
    write(tmp_path / name)
    plan = read_drawing(tmp_path / name)
    assert (set(plan.cables), plan.ridges, plan.upright, plan.loose) == (
        {"east", "free 1"},
        {"ridge"},
        {"hall"},
        True,
    )
    np.testing.assert_allclose(plan.cables["east"].at([0.0, 1.0]), [[10, 0], [10, 6]])  # to the corners
    np.testing.assert_allclose(plan.mirrors[0].at([0.0, 1.0]), [[0, 0], [0, 6]])
    assert len(plan.dividers["hall"].pieces) == 2
    np.testing.assert_allclose(plan.supports[0].at([0.0, 1.0]), [[1, 0, 2], [4, 0, 2]])
    with pytest.warns(FileWarning, match="1 end of mirrors moved by up to 0.004"):
        surface = project.build(tmp_path / name)
    tensions = {cable.name: cable.tension for cable in surface.cables}
    assert {"east", "free 1", "ridge"} <= set(tensions)
    X = surface.vertices[surface.fixed]
    np.testing.assert_allclose(np.unique(X[X[:, 2] > 0.0][:, 2]), [2, 3])
    assert len(surface.on_planes) == 2  # the mirror, and that of the upright line


MASTS = [("point", "mast", point) for point in ((0, 0, 4), (10, 0, 1), (10, 6, 4), (0, 6, 1))]


def dirty(path):
    """A Y whose three ends miss each other by 4 mm, and whose other ends miss their edges."""
    document, space = drawn.new()
    space.add_lwpolyline([(0, 0), (16, 0), (16, 14), (0, 14)], close=True, dxfattribs=on("outline"))
    ends = ((8.004, 6), (8, -0.003), "a"), ((8, 6.004), (0, 10), "b"), ((7.997, 5.998), (16, 10.002), "c")
    for start, end, name in ends:
        space.add_line(start, end, dxfattribs=on(f"divider {name}"))
    document.saveas(path)
    return path


def raised(path):
    """A sail whose north edge is on a wall 5 m high."""
    lines = (
        ("line", "support", (0, 6, 5), (10, 6, 5)),
        ("point", "mast", (0, 0, 2)),
        ("point", "mast", (10, 0, 3)),
    )
    return drawing(path.parent, *lines)


DRAWN = {
    "masts on the outline": (lambda path: drawing(path.parent, *MASTS), ["roof"], 4),
    "a raised support": (raised, ["roof"], 3),
    "a free edge and a named cable": (
        lambda path: drawing(
            path.parent, ("line", "free", (0, 0), (10, 0)), ("line", "cable n", (0, 6), (10, 6))
        ),
        ["roof"],
        2,
    ),
    "a nave": (drawn.nave, ["west", "east", "apse", "chancel", "middle"], 0),
    "a dirty Y": (dirty, ["patch 1", "patch 2", "patch 3", "a", "b", "c"], 0),
    "half with an upright wall": (
        lambda path: drawing(
            path.parent, ("line", "mirror", (0, 0), (10, 0)), ("line", "upright", (5, 0), (5, 6))
        ),
        ["patch 1", "patch 2", "wall 1"],
        0,
    ),
}


@pytest.mark.parametrize("case", night_but(DRAWN, "masts on the outline", "a dirty Y"))
def test_the_project_that_pcmc_plan_writes_is_solved_and_certified(tmp_path, case):
    make, patches, cables = DRAWN[case]
    text, _ = project.planning.project_text(make(tmp_path / "hall.dxf"))
    (tmp_path / "hall.toml").write_text(text)
    outcome = project.run_project(project.load(tmp_path / "hall.toml"), use_cache=False)
    assert outcome.good
    assert [patch.name for patch in outcome.surface.patches] == patches
    assert len(outcome.surface.cables) == cables


def test_the_ends_of_a_dirty_y_meet_in_one_point(tmp_path):
    plan = read_drawing(dirty(tmp_path / "y.dxf"))
    starts = [curve.at([0.0])[0] for curve in plan.dividers.values()]
    np.testing.assert_allclose(
        starts, np.tile(np.mean([[8.004, 6], [8, 6.004], [7.997, 5.998]], axis=0), (3, 1))
    )
    assert [curve.at([1.0])[0].tolist() for curve in plan.dividers.values()] == [
        [8, 0],
        [0, 10],
        [16, 10.002],
    ]
    wide = read_drawing(dirty(tmp_path / "y.dxf"), gap=1e-4)
    with refused(PlanError, what="divider 'b'", found=pytest.approx(0.004, rel=0.02)):
        project.planning.plan_from(proposed(wide)).surface()


def test_a_project_that_follows_its_drawing_changes_a_drawn_cable(tmp_path):
    drawing(tmp_path, ("line", "cable south", (0, 0), (10, 0)), *MASTS[2:])
    path = tmp_path / "roof.toml"
    path.write_text('[plan]\ndrawing = "hall.dxf"\n[[plan.cables]]\nname = "south"\ntension = 77.0\n')
    loaded = project.load(path)
    assert [(cable.name, cable.tension) for cable in loaded.plan.cables] == [("south", 77.0)]
    assert loaded.plan.edge == "cable"
    assert loaded.chosen.cables == {"": loaded.plan.cable}
    assert "cable = ... under [plan]" in loaded.chosen.text


def test_supports_that_change_nothing_are_noted(tmp_path):
    note = read_drawing(drawing(tmp_path, ("point", "support", (0, 0)))).notes[-1]
    assert "all of the outline is held" in note
    assert not read_drawing(
        drawing(tmp_path, ("line", "free", (0, 0), (10, 0)), ("point", "support", (5, 0)))
    ).notes


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (("line", "free", (2, 2), (8, 4)), "layer 'free': LINE 8B"),
        (("arc", "mirror", (5, 0), 2.0, 0, 180), "layer 'mirror'"),
        (("text", "height", "1_000"), "layer 'height'"),
        (("text", "height", "1 000 m"), "layer 'height'"),
        (("text", "patch", "nave = 1_000"), "layer 'patch'"),
        (("text", "patch", "nave = four"), "layer 'patch'"),
    ],
)
def test_lines_and_texts_that_mean_nothing_are_refused(tmp_path, call, what):
    with refused(PlanError, what=what):
        read_drawing(drawing(tmp_path, *[call]))


def test_heights_in_texts_have_the_unit_of_the_drawing_or_their_own(tmp_path):
    for text, height in (("4500", 4.5), ("+4500,5", 4.5005), ("OK 4.5 m", 4.5)):
        plan = read_drawing(drawing(tmp_path, ("text", "height", text), unit=4), "m")
        assert plan.heights[0, 2] == pytest.approx(height, rel=1e-12)
    (label,) = read_drawing(drawing(tmp_path, ("text", "patch", "nave = 4,5"))).labels
    assert (label.name, label.tension) == ("nave", 4.5)


def test_a_whole_outline_may_be_a_cable(tmp_path):
    file = drawing(tmp_path, *MASTS, ("lwpolyline", "cable rim", [*BOX, BOX[0]]))
    assert [cable.name for cable in project.build(file).cables] == [f"rim-{k}" for k in (1, 2, 3, 4)]


def test_a_weight_and_a_pressure_of_all_patches_beside_a_drawing(tmp_path):
    drawn.nave(tmp_path / "hall.dxf")
    given = {"weight": 0.02, "pressure": 0.9, "patches": {"apse": {"weight": 0.05}}}
    plan = project.planning.plan_from(proposed(read_drawing(tmp_path / "hall.dxf"), given))
    patches = {
        p.name: (p.pressure, p.weight) for p in plan.surface().patches if p.name in ("west", "east", "apse")
    }
    assert patches == {"west": (0.9, 0.02), "east": (0.9, 0.02), "apse": (0.9, 0.05)}
