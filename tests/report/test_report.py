"""The report: the roof's numbers, the same bytes each time, and no page of a bad roof unmarked."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from nightly import at_night
from printed import words_of
from refusals import refused
from small_project import WITH_UNITS
from starts import joined_caps, stationary
from structures import pyramid

import pcmc
from pcmc import Patch, Surface, Verdict, cli
from pcmc.base.errors import FileError, MissingExtra, OptionError, SurfaceError
from pcmc.base.units import Units
from pcmc.cloth.sheets import seam_sheet
from pcmc.drawings.sheet import register_fonts
from pcmc.plan import Divider, Plan
from pcmc.report import RoofReport, roof_report, tables, words
from pcmc.report.pages import pdf
from pcmc.report.plan import paper_plan
from pcmc.report.tables import Heading

UNITS = Units("m", "kN")
FORCES = ["force_x", "force_y", "force_z"]
GOAL = (
    WITH_UNITS
    + """[targets]
meet = [{quantity = "apex", of = "roof", value = %s}]
vary = ["roof"]
[output]
tolerance = 0.02
date = "1 May"
"""
)


@pytest.fixture(scope="module")
def caps():
    return stationary(partial(joined_caps, 1.0)).surface


@pytest.fixture(scope="module")
def pages(caps, tmp_path_factory):
    """The pages of a report with everything in it."""
    path = tmp_path_factory.mktemp("report") / "caps.pdf"
    report = roof_report(
        caps,
        UNITS,
        name="<b>caps & more</b>",
        tolerance=0.05,
        mesh_check=pcmc.check_mesh(caps, 2),
        files={"caps.3dm": "surface"},
        date="1 May",
    )
    report.write(path)
    first = path.read_bytes()
    assert report.write(path).read_bytes() == first
    return words_of(path)


def test_each_page_has_its_number_and_the_name(pages):
    for number, page in enumerate(pages, start=1):
        assert f"page {number} of {len(pages)}" in page
        assert "<b>caps & more</b>" in page
        assert "1 May" in page
        assert "NOT CERTIFIED" not in page


@pytest.mark.parametrize("lines", range(32, 38))
def test_no_heading_is_alone_at_the_foot_of_a_page(tmp_path, lines):
    register_fonts()
    rows = [[f"row {k}", "1"] for k in range(90)]
    above = [*["a line"] * lines, tables.Table("", ["of", "value"], rows[:9])]
    told = "persists: finer meshes have the same surface. " * 6
    blocks = [*above, Heading("Mesh check"), told, tables.Table("", ["of", "value"], rows)]
    (tmp_path / "a.pdf").write_bytes(pdf(blocks, "title", "foot", ""))
    page = next(page for page in words_of(tmp_path / "a.pdf") if "Mesh check" in page)
    assert "row 1" in page.partition("Mesh check")[2]


def test_the_report_says_how_far_reactions_differ_from_loads(caps):
    certificate = pcmc.certify(caps)
    share = 100.0 * certificate.balance["force_share"].iloc[-1]
    assert f" Their sum differs from that of the loads by {share:.1g} %" in words.about_forces(
        UNITS, certificate
    )


def test_it_has_every_number_of_the_certificate(pages, caps):
    text, certificate = "\n".join(pages), pcmc.certify(caps)
    assert words.VERDICTS[certificate.verdict][:40] in " ".join(text.split())
    for k, row in enumerate(certificate.boundaries.itertuples(), start=1):
        (line,) = re.findall(rf"^ *B{k} +{row.boundary} .*$", text, re.M)
        found = [float(x) for x in line.split()[-5:]]
        wanted = [row.length, row.reaction_x, row.reaction_y, row.reaction_z, row.per_length_max]
        largest = max(map(abs, wanted))
        np.testing.assert_allclose(found, wanted, atol=2e-3 * largest)
    assert len(re.findall(r"^ *J\d+ ", text, re.M)) == len(certificate.junctions)
    for patch in caps.patches:
        assert re.search(rf"^ *{patch.name} +(roof|wall) ", text, re.M)
    assert f"{pcmc.certify(caps).volume:.1f} m³" in text
    lifted, held = (
        float(re.search(rf"^ *{label}, upwards +(\S+) kN", text, re.M)[1])
        for label in ("pressure, snow and weight", "all reactions")
    )
    assert lifted > 0.0  # the pressure lifts the roof, and its supports hold it down
    assert held == pytest.approx(-lifted, rel=2e-3)
    for part in ("Mesh check", "Panels", "families", "caps.3dm", "reportlab", "kN/m²"):
        assert part in text


def test_the_plan_is_to_scale(caps):
    plan = paper_plan(caps, pcmc.certify(caps), UNITS)
    rims = np.concatenate([line.points for line in plan.lines if line.layer == "PCMC-RIM"])
    factor = 1000.0 / float(plan.scale.removeprefix("1:"))
    assert np.ptp(rims, axis=0) == pytest.approx(factor * np.ptp(caps.vertices[:, :2], axis=0))
    every = np.concatenate([line.points for line in plan.lines])
    assert (every >= 0.0).all()
    assert (every <= plan.size).all()
    assert plan.size[0] <= 174.0
    certificate = pcmc.certify(caps)
    names = [f"J{k + 1}" for k in range(len(certificate.junctions))]
    names += [f"B{k + 1}" for k in range(len(certificate.boundaries))]
    assert set(names) <= {text.text for text in plan.texts}
    places = np.array([text.at for text in plan.texts if text.text in names])
    away = np.linalg.norm(places[:, None] - places[None], axis=2) + 100.0 * np.eye(len(places))
    assert away.min() > 2.0  # mm, also where a wall stands below its ridge


@pytest.mark.parametrize(("unit", "factor", "text"), [("m", 1.0, "12.000"), ("mm", 1e3, "12000")])
def test_dimensions_have_the_decimals_of_the_unit(unit, factor, text):
    """A plan in mm with "12000.000" pretends to a thousandth of a millimetre."""
    corners = factor * np.array([[0, 0], [12, 0], [12, 8], [0, 8]])
    roof = pcmc.solve(Plan(corners, edge_length=2.0 * factor, tension=6.0, pressure=1.0 / factor).surface())
    plan = paper_plan(roof.surface, roof.certificate, Units(unit, "kN"))
    assert text in {text.text for text in plan.texts}
    pattern = pcmc.cutting_pattern(roof.surface, strips=2, compensation=(0, 0))
    assert text in {found.text for found in seam_sheet(pattern, "A4", unit).drawn()[1]}


@pytest.fixture(scope="module")
def court():
    """A square roof around a square court, both around one centre."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    plan = Plan(4.0 * corners, holes=[1.5 * corners], edge_length=1.2, tension=4.0)
    return pcmc.solve(plan.surface()).surface


def test_the_plan_names_closed_curves_where_they_are(court):
    """The middle of the rim is that of the court, too."""
    plan = paper_plan(court, pcmc.certify(court), UNITS)
    rims = np.concatenate([line.points for line in plan.lines if line.layer == "PCMC-RIM"])
    middle, factor = 0.5 * (rims.min(axis=0) + rims.max(axis=0)), 1e3 / float(plan.scale.partition(":")[2])
    away = {text.text: np.linalg.norm(text.at - middle) / factor for text in plan.texts}
    assert 1.0 < away["B2"] < 2.6 < 3.4 < away["B1"]


def test_held_curves_around_one_centre_have_names_of_their_own(court):
    """Else a row of the mesh check has the value of one and the bar of both."""
    check = pcmc.check_mesh(court)
    names = check.table.loc[check.table["quantity"] == "reaction", "of"].tolist()
    assert names == ["", "patch 1 near (0, 0), B1", "patch 1 near (0, 0), B2"]
    held = pcmc.certify(court).supports["force_z"].tolist()
    assert [check.row("reaction", name).value for name in names[1:]] == pytest.approx(held)


def test_every_verdict_has_its_sentence():
    assert set(words.VERDICTS) == set(Verdict)


def test_the_verdict_in_words(caps):
    certificate = replace(pcmc.certify(pyramid()), detail="a reason", residual=3e-12)
    _, *sentences = words.verdict_sentences(certificate)
    assert sentences[:2] == ["In detail: a reason.", "The forces left are 3e-12 of the forces in the roof."]
    of_curvature, of_load, balance = sentences[2:]
    assert certificate.curvature_error == 0.0
    assert of_curvature.startswith("By its forces each patch has the mean curvature")
    assert of_curvature.endswith("tension and pressure ask for.")
    bent = pcmc.certify(caps)
    assert f" up to {tables.small(bent.curvature_error)} of it." in words.verdict_sentences(bent)[2]
    assert f" {100.0 * certificate.load_ratio:.0f} % of the most" in of_load
    assert balance.startswith("The supports carry")
    assert [tables.small(x) for x in (0.0, 0.0012, np.inf, np.nan)] == ["0", "1e-03", "–", "–"]


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ([0.0, 0.0], ["0", "0"]),
        ([1234.5678, 0.01], ["1235", "0"]),
        ([np.nan, np.inf, 0.5], ["–", "–", "0.5000"]),
        ([2e12, 1.0], ["2.000e+12", "1.000e+00"]),
        ([-3e-9, 2.0], ["0.000", "2.000"]),
    ],
)
def test_numbers_of_a_column_have_the_same_decimals(values, texts):
    assert tables.column(values) == texts


def bad_roof():
    """A pyramid that is not at rest."""
    corners = [[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0], [0, 0, 0.7]]
    faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    return Surface(corners, faces, [0] * 4, [Patch("roof", 1.0)], fixed=range(4))


def test_a_roof_that_is_not_certified_is_refused_or_every_page_is_marked(tmp_path):
    with refused(SurfaceError, what="surface", found=Verdict.NOT_CONVERGED):
        roof_report(bad_roof(), "m")
    path = roof_report(bad_roof(), "m", anyway=True).write(tmp_path / "bad.pdf")
    pages = words_of(path)
    assert len(pages) > 1
    assert all("NOT CERTIFIED: not converged" in page for page in pages)


@pytest.mark.parametrize(
    ("units", "options", "fields"),
    [
        ("", {}, {"what": "units", "found": ""}),
        (Units(), {}, {"what": "units"}),
        ("parsec", {}, {"what": "units", "found": "parsec"}),
        (3, {}, {"what": "units", "found": 3}),
        ("m", {"tolerance": 0.0}, {"what": "tolerance", "found": 0.0}),
    ],
)
def test_what_cannot_be_reported_is_refused(small_cap, units, options, fields):
    with refused(OptionError, **fields):
        roof_report(small_cap, units, **options)


def test_it_is_written_whole_as_pdf_or_not_at_all(tmp_path, small_cap, monkeypatch):
    report = roof_report(small_cap, "m")
    with refused(FileError, found=".txt"):
        report.write(tmp_path / "roof.txt")
    monkeypatch.setattr(RoofReport, "pdf", lambda report: b"%PDF")
    with refused(FileError, what=str(tmp_path / "no" / "roof.pdf")):
        report.write(tmp_path / "no" / "roof.pdf")
    monkeypatch.setitem(sys.modules, "reportlab", None)
    with pytest.raises(MissingExtra, match=r"\[report\]"):
        roof_report(small_cap, "m")
    assert not list(tmp_path.iterdir())


def test_the_command_reports_on_the_designed_roof(tmp_path, monkeypatch, capsys):
    """Targets, and the project's tolerance and date."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(GOAL % 0.6)
    assert cli.main(["report", "roof.toml", "-o", "roof.pdf", "--no-mesh-check"]) == 0
    text = "\n".join(words_of("roof.pdf"))
    assert re.search(r"apex of roof +0\.6000 +0\.6000 +m +yes", text)
    assert "1 May" in text
    assert re.search(r"F1 +\d+", text)
    assert "Mesh check" not in text
    capsys.readouterr()
    for arguments in (["roof.toml", "-o", "x.doc"], ["roof.toml", "-o", "x.pdf", "--tolerance", "0"]):
        assert cli.main(["report", *arguments]) == 2
        assert capsys.readouterr().err.count("\n") == 1
    (tmp_path / "roof.toml").write_text(GOAL.replace('units = "m"\nforce = "kN"\n', "") % 0.6)
    assert cli.main(["report", "roof.toml", "-o", "x.pdf"]) == 2
    assert 'units = "m"' in capsys.readouterr().err
    assert not (tmp_path / "x.pdf").exists()


@pytest.mark.parametrize(
    ("command", "output"),
    [
        *at_night((["report", "--no-mesh-check"], "roof.pdf")),
        (["draw"], "roof.pdf"),
        (["panels", "--tolerance", "0.1"], "roof.csv"),
    ],
)
def test_a_roof_that_misses_its_targets_is_refused(tmp_path, monkeypatch, capsys, command, output):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(GOAL % 30.0)
    name, *options = command
    assert cli.main([name, "roof.toml", "-o", output, *options]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "misses its targets" in error
    assert not (tmp_path / output).exists()
    assert cli.main([name, "roof.toml", "-o", output, *options, "--allow-uncertified"]) == 1
    if output.endswith(".pdf"):
        assert all("TARGETS NOT MET" in page for page in words_of(output))


def test_masts_have_their_reactions(tmp_path):
    """Four held corners between free edges with cables: forces at points, none per length."""
    edge = {"edge": "cable", "cable": 30.0, "supports": [[0, 0, 0], [8, 0, 1], [8, 6, 0], [0, 6, 1]]}
    patches = {"roof": {"tension": 4.0, "pressure": 0.0, "weight": 0.2}}
    plan = Plan([[0, 0], [8, 0], [8, 6], [0, 6]], edge_length=1.5, patches=patches, **edge)
    roof = pcmc.solve(plan.surface()).surface
    text = "\n".join(words_of(roof_report(roof, UNITS).write(tmp_path / "mast.pdf")))
    rows = np.array([row.split() for row in re.findall(r"^ *S\d +point (.*) –$", text, re.M)])
    points = np.flatnonzero(roof.fixed)
    assert set(rows[:, 3]) == {"–"}  # a point has no length
    np.testing.assert_allclose(rows[:, :3].astype(float), roof.vertices[points], atol=1e-3)
    np.testing.assert_allclose(rows[:, 4:].astype(float), pcmc.certify(roof).reactions[points], atol=0.01)
    assert "Ends of cables" in text
    assert re.search(r"^ *roof +roof +4.000", text, re.M)  # no wall, though its pressure is 0
    assert "weight," in text


@pytest.mark.nightly
def test_names_as_long_and_odd_as_they_may_be_are_laid_out(tmp_path, caps):
    """Names that do not fit a column are broken; none is markup or mathematics."""
    names = ["W" * 100, "$\\frac{$ </b> & %s", "x" * 50 + " " + "y" * 49]
    patches = [replace(patch, name=name) for patch, name in zip(caps.patches, names, strict=False)]
    report = roof_report(caps.rebuilt(patches=patches), "m", name="W" * 255, tolerance=0.05, anyway=True)
    assert report.write(tmp_path / "roof.pdf").read_bytes().startswith(b"%PDF")


def test_upright_and_leaning_walls_and_the_balance(tmp_path):
    """What holds an upright wall is a support like others; how far the other wall leans is told."""
    walls = [Divider([[4, 0], [4, 4]], upright=True), Divider([[8, 0], [8, 4]])]
    patches = {
        name: {"tension": t, "pressure": p} for name, t, p in zip("abc", (4, 3, 3), (1, 1.3, 1), strict=True)
    }
    plan = Plan([[0, 0], [12, 0], [12, 4], [0, 4]], walls, edge_length=1.0, patches=patches)
    roof = pcmc.solve(plan.surface()).surface
    found, report = pcmc.certify(roof), roof_report(roof, UNITS)
    text = "\n".join(words_of(report.write(tmp_path / "walls.pdf")))
    (row,) = re.findall(r"^ *B\d+ +wall 1, upright +upright plane +(.*)$", text, re.M)
    wanted = found.supports[found.supports["kind"] == "upright plane"].iloc[0]
    numbers = [float(x) for x in row.split()]
    np.testing.assert_allclose(numbers[3:], wanted[["length", *FORCES, "per_length_max"]].tolist(), atol=6e-3)
    for part in ("loads", "supports", "remainder"):
        (row,) = re.findall(rf"^ *{part} +(-?\d.*)$", text, re.M)
        exact = found.balance.set_index("of").loc[part, [*FORCES, "moment_x", "moment_y", "moment_z"]]
        np.testing.assert_allclose([float(x) for x in row.split()], exact.tolist(), atol=6e-3)
    lean = found.leaning.set_index("wall")["lean"]
    assert lean["wall 2"] > 1.0
    for wall in ("wall 1", "wall 2"):
        assert re.search(rf"^ *{wall} +{lean[wall]:.1f} ", text, re.M)
    assert "The supports carry the loads" in " ".join(text.split())
    assert {"B1", "B7"} <= {label.text for label in report.plan.texts}


def test_what_rounding_leaves_of_forces_and_of_a_flat_curvature_is_0():
    """A sail of tension alone: its reactions cancel, and its mean curvature is rounding."""
    corners = [[0, 0, 4], [10, 0, 0], [10, 10, 4], [0, 10, 0]]
    plan = Plan(
        [[0, 0], [10, 0], [10, 10], [0, 10]],
        edge="cable",
        cable=9.0,
        supports=corners,
        edge_length=2.0,
        tension=1.0,
        pressure=0.0,
    )
    sail = pcmc.solve(plan.surface()).surface
    certificate = pcmc.certify(sail)
    assert (certificate.support, certificate.load) == (0.0, 0.0)
    assert not certificate.balance[[*FORCES, "moment_x", "moment_y", "moment_z"]].to_numpy().any()
    assert certificate.balance["force_share"].iloc[-1] == 0.0
    figures = dict(
        tables.key_figures(sail, pcmc.certificate.quantities.figures(sail, certificate), UNITS).rows
    )
    assert figures["all reactions, upwards"] == "0 kN"
    assert certificate.patches["mean_H"].tolist() == [0.0]
    patches = tables.table_of_patches(sail, certificate, UNITS)
    assert patches.rows[0][patches.head.index("mean curvature, 1/m")] == "0"
