"""Cutting patterns in files: sheets, tables, the section of a project, the command."""

from itertools import combinations

import ezdxf
import numpy as np
import pandas as pd
import pytest
from printed import words_of
from shapely import Point, Polygon

from generators import joined_caps
from pcmc import Plane, Surface, cutting_pattern, project, solve, write
from pcmc.base.errors import MissingExtra, OptionError, PcmcError
from pcmc.cli import main
from pcmc.cloth import pattern_drawings
from pcmc.cloth.sheets import strip_lines
from pcmc.plan import Plan
from pcmc.plot import strains

PROJECT = """
units = "m"
[plan]
edge_length = 0.8
outline = [[0, 0], [8, 0], [8, 4], [0, 4]]
dividers = [[[4, 0], [4, 4]]]
patches = {west = {tension = 6.0}, east = {tension = 6.0}}
"""


@pytest.fixture(scope="module")
def pattern():
    options = {"allowance": 0.05, "hem": 0.15, "compensation": (0.5, 1.0), "notches": 1.0}
    return cutting_pattern(solve(joined_caps()).surface, 3.0, **options)


def test_allowances_surround_the_net_strip(pattern):
    for strip in pattern.strips:
        lines, labels = strip_lines(pattern, strip)
        by_layer = {
            layer: [line for line in lines if line.layer == layer] for layer in {x.layer for x in lines}
        }
        (outer,), (net,) = (
            (Polygon(by_layer[layer][0].points) for layer in ("PCMC-CUT",)),
            by_layer["PCMC-SEAM"],
        )
        inner = Polygon(net.points)
        assert outer.within(inner.buffer(3.0 * 0.15 + 1e-9))
        assert inner.area == pytest.approx(strip.cut_area)
        assert outer.contains(inner)
        ends = [line.points[1] for line in lines if line.layer == "PCMC-NOTCH"]
        assert not any(inner.contains(Point(end)) for end in ends)  # outward
        hem = outer.boundary.distance(inner)
        assert hem == pytest.approx(0.05, abs=1e-6)
        added = sum(
            (0.15 if seam.kind == "rim" else 0.05) * pattern.side_lengths(side).sum()
            for seam in pattern.seams
            for side in seam.sides
            if side.strip == strip.number
        )
        assert outer.area - inner.area == pytest.approx(added, rel=0.05)  # and corners
        assert len(labels) == sum(side.strip == strip.number for s in pattern.seams for side in s.sides)


def test_corners_of_allowances_are_where_the_lines_outside_meet():
    """A rectangle with two seams and two rims: the cut line is the rectangle with its own allowance on each
    side, without the ears of a wider hem beside a narrow seam."""
    flat = Plan([[0, 0], [6, 0], [6, 2], [0, 2]], edge_length=1.0, tension=2.0, pressure=0.0).surface()
    seams = [[[2, 0], [2, 2]], [[4, 0], [4, 2]]]
    pattern = cutting_pattern(flat, seams=seams, allowance=0.05, hem=0.2, anyway=True)
    middle = min(pattern.strips, key=lambda strip: abs(strip.roof[:, 0].mean() - 3.0))
    (cut,) = (line.points for line in strip_lines(pattern, middle)[0] if line.layer == "PCMC-CUT")
    assert np.sort(np.ptp(cut, axis=0)) == pytest.approx([2.1, 2.4])
    assert Polygon(cut).area == pytest.approx(2.1 * 2.4)


def test_beyond_an_acute_corner_there_is_as_much_cloth_as_beside_it():
    """Of 9.5 degrees, where the lines outside meet twelve hems away: there cloth is cut across at three. And
    along straight sides of several edges no slit of rounding reaches the seam."""
    flat = Plan([[0, 0], [6, 0], [6, 1]], edge_length=0.5, tension=2.0, pressure=0.0).surface()
    pattern = cutting_pattern(flat, strips=1, hem=0.1, anyway=True)
    (strip,) = pattern.strips
    lines = {line.layer: Polygon(line.points) for line in strip_lines(pattern, strip)[0] if line.closed}
    net, cut = lines["PCMC-SEAM"], lines["PCMC-CUT"]
    assert cut.boundary.distance(net) == pytest.approx(0.1)
    half = np.arctan(1 / 6) / 2  # the line across is square to the bisector of the corner
    across = (0.1 - 0.3 * np.sin(half)) / np.cos(half)
    assert cut.hausdorff_distance(net) == pytest.approx(np.hypot(0.3, across))


def test_corners_that_point_across_the_warp_stay_within_the_width_of_the_cloth():
    """With 3 hems of 0.2 beyond its acute corner the first strip of the triangle would be 0.2 too wide."""
    flat = Plan([[0, 0], [6, 0], [6, 1]], edge_length=0.5, tension=2.0, pressure=0.0).surface()
    pattern = cutting_pattern(flat, 1.4, hem=0.2, allowance=0.1, direction=90.0, anyway=True)
    for strip in pattern.strips:
        (cut,) = (line.points for line in strip_lines(pattern, strip)[0] if line.layer == "PCMC-CUT")
        assert np.ptp(cut[:, 1]) <= 1.4 + 1e-9
        assert Polygon(cut).exterior.distance(Polygon(strip.cut[strip.outlines[0]])) >= 0.1 - 1e-9


def test_a_hole_in_a_strip_is_cut_out_smaller_by_its_hem():
    square = [[2, 0.5], [4, 0.5], [4, 1.5], [2, 1.5]]
    plan = Plan([[0, 0], [6, 0], [6, 2], [0, 2]], holes=[square], edge_length=0.5, tension=2.0, pressure=0.0)
    pattern = cutting_pattern(plan.surface(), strips=1, hem=0.2, anyway=True)
    lines, _ = strip_lines(pattern, pattern.strips[0])
    cut = [np.ptp(line.points, axis=0) for line in lines if line.layer == "PCMC-CUT"]
    assert np.sort(cut) == pytest.approx(np.array([[2.4, 6.4], [0.6, 1.6]]))


def test_notches_of_both_sides_lie_on_each_other(pattern):
    """In as many places, as far along both sides as on the roof."""
    for seam in pattern.seams:
        if seam.kind == "rim":
            continue
        places = []
        for side in seam.sides:
            strip = pattern.strips[side.strip - 1]
            notches = [x.points[0] for x in strip_lines(pattern, strip)[0] if x.layer == "PCMC-NOTCH"]
            ends = strip.cut[side.edges]
            start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
            lengths = np.linalg.norm(along, axis=1)
            before = np.append(0.0, np.cumsum(lengths))[:-1]
            found = []
            for notch in notches:
                t = ((notch - start) * along).sum(axis=1) / lengths**2
                away = np.linalg.norm(start + np.clip(t, 0, 1)[:, None] * along - notch, axis=1)
                if away.min() < 1e-9:
                    k = int(away.argmin())
                    found.append(before[k] + t[k] * lengths[k])
            places.append(sorted(found))
        assert len(places[0]) == len(places[1]) == int(seam.length)
        even = np.arange(1, len(places[0]) + 1) / (len(places[0]) + 1)
        assert np.array(places[0]) / lengths.sum() == pytest.approx(even, abs=0.02)
        assert places[0] == pytest.approx(places[1], rel=1e-4)


def test_sheets_and_model_have_every_strip(pattern, tmp_path):
    drawings = pattern_drawings(pattern, "m", sheet="A3", name="caps")
    written = drawings.write(tmp_path / "caps.dxf", tmp_path / "caps.pdf", tmp_path / "caps.svg")
    assert len(written) == 2 + len(drawings.sheets)
    assert (tmp_path / "caps.pdf").read_bytes()[:4] == b"%PDF"
    document = ezdxf.readfile(tmp_path / "caps.dxf")
    model = document.modelspace()
    outlines = model.query("LWPOLYLINE[layer=='PCMC-SEAM']")
    areas = [Polygon([p[:2] for p in line.get_points()]).area for line in outlines]
    assert areas == pytest.approx([strip.cut_area for strip in pattern.strips])  # true size, in metres
    assert len(model.query("LWPOLYLINE[layer=='PCMC-CUT']")) == len(pattern.strips)
    numbers = [text.dxf.text for text in model.query("TEXT[layer=='PCMC-POINT']")]
    assert numbers == [str(strip.number) for strip in pattern.strips]
    titles = [sheet.title for sheet in drawings.sheets]
    assert titles[0] == "Seams on the roof"
    assert titles[-2:] == ["Strips", "Seams"]


def test_strips_lie_apart_at_true_size_each_with_its_number_inside(pattern):
    flat = pattern_drawings(pattern, "m", sheet="A3").flat
    cut = [Polygon(line.points) for line in flat.lines if line.layer == "PCMC-CUT"]
    assert all(one.distance(other) > 1.0 for one, other in combinations(cut, 2))  # mm
    for strip, outline in zip(pattern.strips, cut, strict=True):
        (at,) = (text.at for text in flat.texts if text.text == f"{strip.number}  {strip.patch}")
        assert outline.contains(Point(at))


def test_the_picture_shows_the_strain(pattern, tmp_path):
    image = strains(pattern, tmp_path / "strain.png", view="plan", width=300)
    assert image.shape[1] == 300
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50


def test_strips_are_cut_shorter_by_what_was_asked_for(pattern):
    assert pattern.table["warp"].to_numpy() == pytest.approx(0.5)
    assert pattern.table["weft"].to_numpy() == pytest.approx(1.0)
    assert "cut shorter  by 0.5 to 0.5 % along the warp, 1 to 1 % along the weft\n" in pattern.text()


def test_a_project_writes_its_pattern(tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(
        PROJECT
        + '[pattern]\nwidth = 1.5\nallowance = 0.03\ncompensation = [0.5, 1.0]\n[output]\nsheet = "A3"\n'
        'pattern = ["cloth.dxf", "cloth.csv"]\n'
    )
    outcome = project.run(path)
    assert [file.name for file in outcome.files] == ["cloth.dxf", "cloth.csv", "cloth-seams.csv"]
    table = pd.read_csv(tmp_path / "cloth.csv")
    assert set(table["patch"]) == {"west", "east"}
    assert table["width"].max() <= 1.44
    assert table["area"].sum() == pytest.approx(sum(outcome.certificate.patches["area"][:2]), rel=0.01)
    seams = pd.read_csv(tmp_path / "cloth-seams.csv")
    assert seams["difference"].max() < 1e-6


def test_the_cloth_of_the_structural_model_is_the_one_that_is_cut(tmp_path):
    """Compensation and warp come from [structure], by patch; the report has a chapter."""
    path = tmp_path / "hall.toml"
    cloth = "weft = 3e5\nshear = 1e4\nwarp = [0, 1, 0]\n[structure.patches.east]\nthickness = 0.002\n"
    text = PROJECT + "[structure]\nyoung = 6e5\nthickness = 0.001\n" + cloth + "[pattern]\nwidth = 1.5\n"
    path.write_text(text + '[output]\npattern = ["cloth.csv"]\nreport = "hall.pdf"\n')
    outcome = project.run(path)
    table = pd.read_csv(tmp_path / "cloth.csv").groupby("patch")[["length", "warp", "weft"]].mean()
    strain = 6.0 * 0.7 / 600.0, 6.0 * (1.0 / 300.0 - 0.3 / 600.0)
    for name, part in (("west", 1.0), ("east", 0.5)):
        expected = [100.0 * (1.0 - 1.0 / (1.0 + part * one)) for one in strain]
        assert table.loc[name, ["warp", "weft"]].to_numpy() == pytest.approx(expected, rel=1e-6)
    assert table["length"].min() > 2.0  # along y, as the warp
    pattern = outcome.cutting_pattern(outcome.project.pattern)
    assert pattern is outcome.cutting_pattern(outcome.project.pattern)
    assert "cut shorter  by 0.3" in str(pattern)
    words = " ".join(words_of(tmp_path / "hall.pdf"))
    assert "Cutting pattern, scale 1:" in words
    area, cut = (f"{pattern.table[of].sum():.4g}" for of in ("area", "cut_area"))
    assert area != cut
    assert f"{len(pattern.strips)} strips, together {area} m² on the roof, {cut} m² cut" in words
    path.write_text(text + 'compensation = [0.5, 1.0]\n[output]\npattern = ["cloth.csv"]\n')
    project.run(path)
    table = pd.read_csv(tmp_path / "cloth.csv")
    assert table["length"].min() > 2.0
    assert table["warp"].to_numpy() == pytest.approx(0.5)
    for more in ("", "compensation = [0.5, 1.0]\n"):
        path.write_text(text + f'{more}direction = 0.0\n[output]\npattern = ["cloth.csv"]\n')
        with pytest.raises(OptionError, match=r"warp of 'west' lies at 0 degrees in \[pattern\], and at 90"):
            project.run(path)


def test_seams_drawn_on_a_half_are_those_of_its_images(tmp_path, capsys):
    """Before, the whole had them on one side alone: the other half was one strip. A seam that is its own
    image, as across the mirror, is sewn once, and so is one that is drawn on both sides."""
    half = "[plan]\nedge_length = 1.0\noutline = [[0, 0], [4, 0], [4, 6], [0, 6]]\ntension = 5.0\n"
    half += "mirrors = [[[4, 0], [4, 6]]]\n"
    seams = "[pattern]\nseams = [[[0, 3], [4, 3]], [[2, 0], [2, 3]]]\n"
    path = tmp_path / "half.toml"
    for whole, strips in ("", 3), ("whole = true\n", 4):
        path.write_text(f'units = "m"\n{half}{seams}[output]\npattern = ["cloth.csv"]\n{whole}')
        project.run(path)
        assert len(pd.read_csv(tmp_path / "cloth.csv")) == strips
    command = ["pattern", str(path), "--whole", "--units", "m", "-o", str(tmp_path / "cloth.csv")]
    for both in ("[[0, 3], [8, 3]]", "[[0, 3], [4, 3]], [[8, 3], [6, 3.001], [4, 3]]"):
        path.write_text(f"{half}[pattern]\nseams = [{both}]\n")
        assert main(command) == 0
        assert len(pd.read_csv(tmp_path / "cloth.csv")) == 2
    path.write_text(half + "[pattern]\nseams = [[[0, 3], [8, 4]]]\n")
    assert main(command) == 2
    assert (
        "seam 1: it goes on behind the mirror plane 'mirror 1', and its image is" in capsys.readouterr().err
    )


CLOTH = "[structure]\nyoung = 1e6\nthickness = 1e-3\nweft = 5e5\nshear = 1e4\n"


@pytest.mark.parametrize("whole", ["", "whole = true\n"])
@pytest.mark.parametrize(
    ("section", "told"),
    [
        ("strips = 2\ndirection = 30.0", 1),
        ("strips = 2\ndirection = 90.0", 0),
        (f"strips = 2\n{CLOTH}warp = [1, 2, 0]", 1),
    ],
)
def test_a_direction_oblique_to_a_mirror_is_named_once(section, told, whole, tmp_path, capsys):
    """The part has the image of its strips behind the mirror, the whole the same direction there."""
    path = tmp_path / "half.toml"
    half = "[plan]\nedge_length = 1.5\noutline = [[0, 0], [4, 0], [4, 6], [0, 6]]\ntension = 5.0\n"
    half += f"mirrors = [[[4, 0], [4, 6]]]\n[output]\n{whole}[pattern]\n{section}\n"
    path.write_text(half)
    assert main(["pattern", str(path), "--units", "m", "-o", str(tmp_path / "cloth.csv")]) == 0
    assert capsys.readouterr().err.count("is neither along the mirror plane 'mirror 1'") == told


def test_the_command_cuts_a_project(tmp_path, capsys):
    path = tmp_path / "hall.toml"
    path.write_text(PROJECT + "[pattern]\nwidth = 3.0\nstiffness = [600, 400]\n")
    files = [tmp_path / "cloth.pdf", tmp_path / "cloth.csv"]
    options = ["--width", "1.5", "--allowance", "0.03", "--picture", str(tmp_path / "strain.png")]
    options += ["--sheet", "A3", "--compensation", "0.5,1.0"]
    assert main(["pattern", str(path), *options, "-o", str(files[0]), "-o", str(files[1])]) == 0
    text = capsys.readouterr().out
    assert "strips" in text
    assert "units  lengths in m," in text
    assert "written:" in text
    table = pd.read_csv(files[1])
    assert table["width"].max() <= 1.44
    assert table["warp"].to_numpy() == pytest.approx(0.5)
    path.write_text(path.read_text() + "[structure]\nyoung = 6e5\nthickness = 0.001\n")
    assert main(["pattern", str(path), "--width", "1.5", "-o", str(files[1])]) == 2
    assert "600 and 400 with poisson 0.3, and young times thickness" in capsys.readouterr().err
    path.write_text(path.read_text() + "weft = 4e5\nshear = 1e5\n")
    assert main(["pattern", str(path), "--seam", "0,2,4,2", "--seam", "4,2,8,2", "-o", str(files[1])]) == 0
    assert len(pd.read_csv(files[1])) == 4
    assert main(["pattern", str(path), "--seam", "0,2,4", "-o", str(files[1])]) == 2
    assert capsys.readouterr().err.startswith("pcmc: error: --seam: expected points X,Y,X,Y and so on")
    few = ["pattern", str(path), "--strips", "2"]
    assert main([*few, "--notches", "1e-9", "-o", str(files[0])]) == 2
    assert "than 1000; give a larger one" in capsys.readouterr().err
    assert main([*few, "-o", str(files[1])]) == 0
    assert pd.read_csv(files[1])["patch"].tolist() == ["west", "west", "east", "east"]


def test_a_surface_has_the_unit_of_its_file(pattern, tmp_path, capsys):
    for unit, code in ("m", 0), ("", 2):
        write(tmp_path / "roof.pcmc", pattern.surface, units=unit)
        command = ["pattern", str(tmp_path / "roof.pcmc"), "--strips", "1", "-o", str(tmp_path / "cloth.dxf")]
        assert main(command) == code
    assert "add units = " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("[pattern]\nwidth = -1\n", "pattern: width: expected"),
        ("[pattern]\nwidht = 2\n", "did you mean 'width'"),
        ("[pattern]\ncompensation = [1]\nstrips = 2\n", "pattern.compensation must be two numbers"),
        ("[pattern]\nstrips = {wset = 2}\n[output]\npattern = ['a.csv']\n", "did you mean 'west'"),
        ("[output]\npattern = ['a.csv']\n", "add \\[pattern\\] with width, strips or seams"),
        ("[pattern]\nstrips = 2\n[output]\npattern = ['a.obj']\n", "the suffix of a cutting pattern is"),
    ],
)
def test_bad_sections_are_refused_in_one_line(section, message, tmp_path):
    path = tmp_path / "hall.toml"
    path.write_text(PROJECT + section)
    with pytest.raises(PcmcError, match=message) as refused:
        project.run(path)
    assert "\n" not in str(refused.value)


def test_units_and_the_library_are_asked_for(pattern, monkeypatch):
    with pytest.raises(OptionError, match="a cutting pattern needs the unit of the lengths"):
        pattern_drawings(pattern, "")
    import pcmc.base.libraries as libraries

    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(libraries, "import_module", missing)
    with pytest.raises(MissingExtra, match=r"potpourri3d is not installed; .*pcmc-surfaces\[cloth\]"):
        cutting_pattern(pattern.surface, 3.0, certificate=pattern.certificate)


def test_seams_on_a_tilted_plane_are_drawn_square_to_it_and_say_so(pattern):
    """The plan from above has other places: these are those of drawn seams."""
    sheets = []
    for plane in (Plane(), Plane((1.0, 2.0, 3.0), (0.6, 0.0, 0.8))):
        s = pattern.surface
        X = s.vertices @ plane.axes + plane.point
        turned = Surface(X, s.faces, s.patch_of_face, s.patches, fixed=s.held, plane=plane)
        sheets.append(pattern_drawings(cutting_pattern(turned, 3.0, anyway=True), "m").sheets[0])
    level, tilted = ([line.points for line in sheet.lines if line.layer == "PCMC-RIM"] for sheet in sheets)
    for one, other in zip(level, tilted, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-3)
    titles = [sheet.title for sheet in sheets]
    assert titles[1] == f"{titles[0]}, seen square to its tilted plane and placed in its axes"
    places = [{text.text for text in sheet.texts} for sheet in sheets]
    assert len(places[0] ^ places[1]) <= 2


def test_a_roof_that_is_not_certified_is_marked(pattern):
    s = pattern.surface
    raised = s.moved(np.where(s.held[:, None], s.vertices, s.vertices * [1.0, 1.0, 1.1]))
    drawings = pattern_drawings(cutting_pattern(raised, strips=2, anyway=True), "m", sheet="A3")
    marks = [text.text for sheet in drawings.sheets for text in sheet.texts if text.layer == "PCMC-MARK"]
    assert len(marks) == len(drawings.sheets)
