"""What commands keep of the [output] of a project: view, place on a map, and the mark of its files."""

import ifcopenshell
import pytest

from pcmc import cli, io

ROOF = """units = "m"
force = "kN"
[plan]
edge_length = 2.0
outline = [[0, 0], [8, 0], [8, 6], [0, 6]]
tension = 5.0
"""
PLACED = (
    '[output]\nfiles = ["roof.ifc"]\ngeoreference = {crs = "EPSG:25832", eastings = 1e5, northings = 1e5}\n'
)
UNFINISHED = "[solve]\niterations = 1\n"


@pytest.fixture
def given(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return (tmp_path / "roof.toml").write_text


def test_a_plot_has_the_view_and_the_colour_of_the_project(given, monkeypatch):
    """Before, its defaults counted instead of these, without a word."""
    given(f'{ROOF}[output]\npicture = "a.png"\nviews = ["plan", [10, 20]]\ncolour = "error"\n')
    drawn = []
    monkeypatch.setattr("pcmc.cli.files.picture_job", lambda roof, path, *look: drawn.append(look))
    monkeypatch.setattr("pcmc.cli.files.write_all", lambda jobs: [])
    for flags in ([], ["--view", "elevation"], ["--colour", "patches"]):
        assert cli.main(["plot", "roof.toml", "b.png", *flags]) == 0
    both = ["plan", [10, 20]]
    assert drawn == [(both, "error"), (["elevation"], "error"), (both, "patches")]


@pytest.mark.filterwarnings("ignore::pcmc.base.errors.LostWarning")
@pytest.mark.parametrize(
    "command",
    [
        ["remesh", "--edge-length", "1.5", "-o", "one.ifc"],
        ["remesh", "--edge-length", "1.5", "-o", "one.ifc", "--no-solve"],
        ["equilibria", "--starts", "0", "--span", "0.99,1.01", "-o", "one.ifc"],
        ["panels", "--tolerance", "1.0", "-o", "one.ifc"],
    ],
)
def test_files_of_commands_keep_the_place_on_a_map(given, tmp_path, command):
    """Before, it was left out without a word."""
    given(ROOF + PLACED)
    assert cli.main([command[0], "roof.toml", *command[1:]]) == 0
    written = ifcopenshell.open(next(tmp_path.glob("one*.ifc")))
    assert written.by_type("IfcMapConversion")[0].Eastings == 1e5


def test_a_surface_of_panels_that_is_not_certified_is_marked(given):
    """Before, it was a good one to whoever opened it."""
    given(ROOF + UNFINISHED)
    assert (
        cli.main(["panels", "roof.toml", "--tolerance", "1.0", "-o", "one.pcmc", "--allow-uncertified"]) == 1
    )
    assert io.load("one.pcmc").certificate["mark"] == "NOT CERTIFIED: not converged"
