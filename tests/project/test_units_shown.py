"""Units behind the numbers that commands, the page and reports show."""

import re

import pytest
from refusals import refused
from small_project import WITH_UNITS
from volume_cases import cap, cap_height, raised

import generators
import pcmc
from pcmc import cli, explore
from pcmc.accuracy.quantities import given_volume
from pcmc.base.errors import OptionError
from pcmc.base.units import Units, as_units
from pcmc.certificate.quantities import dimension_of
from pcmc.explore.page_data import mesh_findings
from pcmc.explore.session import Session, solved_start
from pcmc.report.tables import mesh_table, target_table

METRES = Units("m", "kN")
GOAL = """
[targets]
meet = [{quantity = "apex", of = "roof", value = 30.0}]
vary = ["roof"]
"""


@pytest.fixture(scope="module")
def bubbles():
    """Two rooms whose volumes are prescribed, and their mesh check."""
    return pcmc.check_mesh(pcmc.solve(generators.double_bubble(0.8, volumes=(1.0, 0.7))), 2)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(WITH_UNITS, encoding="utf-8")
    (tmp_path / "high.toml").write_text(WITH_UNITS + GOAL, encoding="utf-8")
    return tmp_path


def lines_of(text):
    """The units of the mesh check's table, by quantity."""
    head = next(line for line in text.splitlines() if "on this mesh" in line)
    rows = text[text.index(head) :].splitlines()[1:]
    return {re.split(r"\s{2,}| \d| -", row.strip())[0]: row.split()[-2] for row in rows if row.strip()}


def test_solve_and_certify_print_the_units_of_the_mesh_check(folder, capsys):
    assert cli.main(["solve", "roof.toml", "-o", "roof.pcmc"]) == 0
    units = lines_of(capsys.readouterr().out)
    assert units["height roof"] == "m"
    assert (units["volume"], units["energy"], units["reaction"]) == ("m³", "kN·m", "kN")
    assert units["lowest eigenvalue"] == "kN/m³"
    assert cli.main(["certify", "roof.pcmc", "--meshes", "2"]) == 0
    out = capsys.readouterr().out
    units = lines_of(out[out.index("persists") :])
    assert (units["area roof"], units["thrust roof"], units["reaction per length roof"]) == (
        "m²",
        "kN",
        "kN/m",
    )
    assert re.search(r"energy  [\d.]+ kN·m\n +volume  [\d.]+ m³\n", out)
    assert re.search(r"load, reactions  [\d.]+ kN, -[\d.]+ kN along", out)


def test_without_units_the_mesh_check_has_no_column_for_them(bubbles):
    assert "unit" not in bubbles.text()
    assert str(bubbles) == bubbles.text()
    assert "unit" in bubbles.brief(METRES)
    assert "force/m" in bubbles.text(Units("m"))


def test_every_quantity_of_a_mesh_check_has_a_unit(bubbles):
    for quantity in bubbles.table.quantity:
        assert METRES.behind(dimension_of(quantity)).strip()


def test_a_missed_target_has_units(folder, capsys):
    assert cli.main(["solve", "high.toml", "--no-mesh-check"]) == 1
    out = capsys.readouterr().out
    assert re.search(r"apex of roof: wanted 30 m, (nearest reachable|so far) [\d.]+ m", out)
    assert re.search(r"\(tension of roof [\d.]+ kN/m\)", out)


def test_an_accuracy_has_units(folder, capsys):
    pytest.importorskip("mmgpy")
    assert cli.main(["solve", "roof.toml", "--accuracy", "height=0.1", "--no-mesh-check"]) == 0
    text = r"height of roof [\d.]+ ± [\d.]+ m on this mesh, [\d.]+ ± [\d.]+ m in the limit, wanted ± 0.1 m"
    assert re.search(text, capsys.readouterr().out)


def test_the_page_shows_the_units_of_mesh_check_and_targets(bubbles):
    rows = {row["name"]: row for row in mesh_findings(bubbles, METRES)["rows"]}
    assert re.fullmatch(r"[\d.]+ ± [\d.]+ m", rows["height of left"]["value"])
    assert rows["volume"]["value"] == rows["volume"]["limit"] == "1.7 m³ (given)"
    assert rows["pressure of left"]["limit"].endswith(" kN/m²")
    roof = generators.spherical_cap(0.5)
    session = Session(solved_start(roof), units=METRES)
    targets, vary = (pcmc.Target("apex", value=30.0),), (pcmc.Parameter("cap"),)
    assert "wanted 30 m, " in session.meet(targets, vary).message
    session.renew(solved_start(roof), Units("ft"), session.fallback)
    assert "wanted 30 ft, " in session.meet(targets, vary).message


@pytest.mark.parametrize(
    ("given", "tension"), [(METRES, "kN/m"), ("ft", "force/ft"), (Units(), "force/length")]
)
def test_a_notebook_gives_its_units_to_the_page(given, tension):
    view = explore.show(generators.spherical_cap(0.5), units=given)
    try:
        assert view.explorer.roof.outcome.units.tension == tension
    finally:
        view.close()


def test_serve_takes_units(monkeypatch):
    opened = []
    monkeypatch.setattr(explore, "open_and_wait", lambda explorer, _: opened.append(explorer))
    explore.serve(generators.spherical_cap(0.5), units="mm")
    opened[0].close()
    assert opened[0].roof.outcome.units == Units("mm")


def test_wrong_units_are_refused():
    for wrong in ("furlong", 3, None):
        with refused(OptionError, what="units", found=wrong):
            explore.show(generators.spherical_cap(0.5), units=wrong)
    assert as_units(METRES) is METRES


def test_a_prescribed_volume_has_no_bar(bubbles):
    row = bubbles.row("volume")
    assert (row.error, row.limit_error) == (0.0, 0.0)
    assert row.value == row.limit == 1.7
    assert re.search(r"volume +1\.7 \(given\) +1\.7 \(given\) +-", bubbles.text())
    assert bubbles.numbers()["volume_error"] == 0.0
    assert mesh_table(bubbles, METRES).rows[5][-4:] == ["given", "1.700", "given", "m³"]


def test_the_pressure_of_a_room_has_a_bar_that_holds():
    """The cap of height h over the unit disc has the pressure p = 4 α h / (1 + h²)."""
    check = pcmc.check_mesh(pcmc.solve(cap(1.0, 0.4)), boundary="smooth")
    row = check.row("pressure", "room")
    h = cap_height(1.0)
    exact = 4.0 * check.surfaces[0].tensions[0] * h / (1.0 + h * h)
    assert abs(row.value - exact) <= row.error
    assert abs(row.limit - exact) <= row.limit_error < row.error


def test_a_volume_that_rooms_leave_open_is_not_given(bubbles):
    both = bubbles.surfaces[0]
    assert given_volume(both) == pytest.approx(1.7, rel=1e-14)
    assert given_volume(both.rebuilt(rooms=both.rooms[:1])) is None
    raised_cap = raised()  # flat fans down to Π close its room, and finer meshes may close it otherwise
    assert given_volume(raised_cap) is None


def test_the_reports_tables_have_units(bubbles):
    design = pcmc.meet(generators.spherical_cap(0.5), [pcmc.Target("apex", value=0.5)], ["cap"])
    assert target_table(design.targets, METRES).rows == [["apex", "0.5000", "0.5000", "m", "yes"]]
    assert mesh_table(bubbles, METRES).rows[0][-1] == "m"
