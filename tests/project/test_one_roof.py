"""One flow of a project: loaded without a mesh, each finding computed once, no input written over."""

import os
import warnings
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from printed import words_of
from refusals import refused
from small_project import WITH_UNITS

import pcmc
from pcmc import cli, project
from pcmc.base.errors import FileError, OptionError, PcmcError
from pcmc.base.units import Units
from pcmc.project import opened

DOCUMENTS = """
[structure]
young = 1e6
thickness = 0.001
[output]
files = ["roof.obj"]
drawings = ["roof.dxf"]
panels = "roof.csv"
tolerance = 0.01
structure = "roof.inp"
report = "roof-report.pdf"
"""
HALF = """
units = "m"
[plan]
edge_length = 0.8
outline = [[0, 0], [4, 0], [4, 6], [0, 6]]
mirrors = [[[0, 0], [0, 6]]]
patches = {roof = {tension = 3.0}}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    Path("roof.toml").write_text(WITH_UNITS, encoding="utf-8")
    return tmp_path


def counted(monkeypatch, *places):
    """The list of the calls of functions that several rooms know by their own names."""
    calls = []
    for place in places:
        path, _, name = place.rpartition(".")
        module = import_module(path)
        function = getattr(module, name)

        def count(*given, _function=function, _name=name, **more):
            calls.append((_name, getattr(given[0], "m", 0)))
            return _function(*given, **more)

        monkeypatch.setattr(module, name, count)
    return calls


@pytest.mark.parametrize(
    "text",
    [
        WITH_UNITS,
        WITH_UNITS.replace("tension = 2.0", "rise = 1.0"),
        WITH_UNITS.replace("patches = {roof = {tension = 2.0}}", "rise = 1.0\ndividers = [[[2, 0], [2, 3]]]"),
        HALF + "[output]\nwhole = true\n",
    ],
)
def test_loading_a_project_meshes_nothing(folder, monkeypatch, text):
    Path("roof.toml").write_text(text, encoding="utf-8")
    calls = counted(monkeypatch, "pcmc.plan.plan.build_surface")
    roof = project.load("roof.toml")
    assert calls == []
    project.surface_of(roof)
    assert calls == [("build_surface", 0)]


def test_a_run_with_all_outputs_computes_each_finding_once(folder, monkeypatch):
    Path("roof.toml").write_text(WITH_UNITS + DOCUMENTS, encoding="utf-8")
    calls = counted(
        monkeypatch,
        "pcmc.project.outcome.certify",
        "pcmc.certificate.certificate.certify",
        "pcmc.certificate.certify",
        "pcmc.project.outcome.panels",
        "pcmc.drawings.drawing_set.panels",
        "pcmc.report.document.panels",
        "pcmc.project.outcome.check_mesh",
        "pcmc.project.outcome.figures",
        "pcmc.certificate.quantities.figures",
    )
    roof = project.run("roof.toml")
    assert len(roof.files) == 7
    own = [name for name, triangles in calls if triangles in (0, roof.surface.m)]  # not the finer meshes
    assert sorted(own) == ["certify", "check_mesh", "figures", "panels"]


def test_a_mesh_check_that_fails_is_in_the_report(folder, monkeypatch):
    def fails(*_, **__):
        raise OptionError("too many triangles")

    monkeypatch.setattr("pcmc.project.outcome.check_mesh", fails)
    Path("roof.toml").write_text(WITH_UNITS + '[output]\nreport = "roof.pdf"\n', encoding="utf-8")
    roof = project.run("roof.toml")
    assert roof.mesh_check is None
    assert roof.mesh_failure == "too many triangles"
    assert "could not be checked: too many triangles" in " ".join(" ".join(words_of("roof.pdf")).split())


def test_the_whole_of_a_half_is_shown_listed_and_kept(folder):
    Path("half.toml").write_text(HALF, encoding="utf-8")
    half = project.designed("half.toml")
    Path("half.toml").write_text(HALF + "[output]\nwhole = true\n", encoding="utf-8")
    whole = project.designed("half.toml")
    assert whole.cached
    assert whole.shown.surface.m == 2 * half.surface.m
    loaded = project.load("half.toml")
    tried = project.solve_project(loaded, project.surface_of(loaded))  # as advice does
    assert tried.shown.surface.m == whole.shown.surface.m
    value = {(f.quantity, f.of): f.value for f in half.figures}
    double = {(f.quantity, f.of): f.value for f in whole.figures}
    for name in ("area", "volume", "load"):
        assert double[name, ""] == pytest.approx(2.0 * value[name, ""], rel=1e-9)
    assert double["apex", ""] == pytest.approx(value["apex", ""], rel=1e-12)
    check = whole.check_mesh()
    assert check is not None
    assert check.surfaces[0].m == whole.shown.surface.m


def test_targets_of_a_half_say_that_they_are_the_half_s(folder):
    text = HALF + '[targets]\nmeet = [{quantity = "area", value = 27.0}]\nvary = ["roof"]\n'
    said = "targets of areas, volumes and lengths are those of the part between the mirror planes"
    for whole in (True, False, True):  # also of a roof that was kept when the project asked for the other
        Path("half.toml").write_text(text + f"[output]\nwhole = {str(whole).lower()}\n", encoding="utf-8")
        outcome = project.designed("half.toml")
        assert (said in outcome.remarks) == whole
        [label] = outcome.report(outcome.output, files={}).targets.index
        assert label == "area" + " (of the part)" * whole


def test_a_value_given_for_what_the_targets_decide_is_named(folder):
    Path("roof.toml").write_text(WITH_UNITS.replace("tension = 2.0", "rise = 1.0"), encoding="utf-8")
    plain = project.designed("roof.toml")
    other = project.designed("roof.toml", changed=lambda surface: surface.retensioned({"roof": 4.0}))
    assert other.surface.tensions == pytest.approx(plain.surface.tensions, rel=1e-4)
    begins = "tension of roof: the value given is where the search begins; the targets decide it"
    assert [begins in roof.notes for roof in (plain, other)] == [False, True]


def test_no_command_writes_over_what_it_reads(folder, capsys):
    pcmc.write("roof.pcmc", opened("roof.toml", start=True).surface)
    os.symlink("roof.pcmc", "link.pcmc")
    os.link("roof.pcmc", "hard.pcmc")
    before = Path("roof.pcmc").read_bytes()
    for output in ("roof.pcmc", "./roof.pcmc", "link.pcmc", "hard.pcmc", str(folder / "roof.pcmc")):
        for command in (["solve", "roof.pcmc", "-o"], ["convert", "roof.pcmc"]):
            assert cli.main([*command, output]) == 2
            assert "is read here, and is not written over; name another file" in capsys.readouterr().err
    assert Path("roof.pcmc").read_bytes() == before
    Path("plan.dxf").write_text("0\nEOF\n", encoding="utf-8")
    assert cli.main(["draw", "plan.dxf", "-o", "plan.dxf"]) == 2
    assert "is read here" in capsys.readouterr().err
    Path("mesh.toml").write_text('mesh = "roof.pcmc"\n[output]\nfiles = ["roof.pcmc"]\n', encoding="utf-8")
    assert cli.main(["solve", "mesh.toml"]) == 2
    assert "is read here" in capsys.readouterr().err


def test_a_pipe_and_deep_toml_are_refused(folder, capsys):
    os.mkfifo("pipe.toml")
    Path("deep.toml").write_text(f"a = {'[' * 5000}{']' * 5000}", encoding="utf-8")
    for name in ("pipe.toml", "deep.toml"):
        assert cli.main(["convert", name, "a.obj"]) == 2
        assert capsys.readouterr().err.count("\n") == 1


def test_notes_of_remeshing_and_of_targets_stay_where_an_accuracy_is_asked_for(folder, monkeypatch):
    from pcmc.project import solving

    asked = []

    def accurate(given, surface, report):
        asked.append(surface.m)
        return solving._solve_or_meet(replace(given, targets=()), surface, report)

    monkeypatch.setattr(solving, "_solve_to_accuracy", accurate)
    text = WITH_UNITS + "[solve]\naccuracy = {height = 1e-2}\n[remesh]\nedge_length = 0.8\n"
    text += '[targets]\nmeet = [{quantity = "apex", value = 0.5}]\nvary = ["roof"]\n'
    Path("roof.toml").write_text(text, encoding="utf-8")
    roof = project.designed("roof.toml")
    assert len(asked) == 1
    assert any("targets met on the first mesh" in note for note in roof.notes)


# -- a mesh as a project -----------------------------------------------------------------------------


@pytest.fixture
def mesh(folder):
    """A roof of 4 m by 3 m as an .obj without units and tensions."""
    surface = opened("roof.toml", start=True).surface
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in surface.vertices.tolist()]
    lines += ["g roof", *(f"f {a} {b} {c}" for a, b, c in (surface.faces + 1).tolist())]
    Path("pavilion.obj").write_text("\n".join(lines), encoding="utf-8")
    return folder


def solved(text, name="mesh.toml"):
    Path(name).write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pcmc.base.errors.FileWarning)
        return project.run(name)


def test_a_remeshed_roof_gets_its_curved_elements_at_the_end(folder):
    text = WITH_UNITS + "[solve]\norder = 2\n[remesh]\nedge_length = 1.2\n"
    (folder / "curved.toml").write_text(text, encoding="utf-8")
    found = project.run("curved.toml")
    assert (found.good, found.surface.order) == (True, 2)
    assert len(found.surface.nodes) == found.surface.m / 4
    assert found.certificate.residual < 1e-12


def test_a_mesh_is_a_project_with_units_supports_rise_remesh_and_output(mesh):
    plan = project.designed("roof.toml")
    table = '[mesh]\nfile = "pavilion.obj"\nsupports = "boundary"\npatches = {roof = {tension = 2.0}}\n'
    same = solved('units = "m"\nforce = "kN"\n' + table)
    assert same.units == Units("m", "kN")
    np.testing.assert_allclose(same.surface.vertices, plan.surface.vertices, atol=1e-9)
    higher = solved('units = "m"\n[mesh]\nfile = "pavilion.obj"\nrise = 0.9\n[remesh]\nedge_length = 0.7\n'
                    '[output]\nfiles = ["out.pcmc"]\n')  # fmt: skip
    assert higher.good
    assert higher.surface.vertices[:, 2].max() == pytest.approx(0.9, abs=1e-6)
    assert pcmc.read("out.pcmc").m == higher.surface.m > plan.surface.m
    assert solved('mesh = "pavilion.obj"\nunits = "mm"\n').units.length == "mm"
    inches = solved('units = "m"\n[mesh]\nfile = "pavilion.obj"\nunits = "in"\n')
    assert np.ptp(inches.surface.vertices[:, 0]) == pytest.approx(4 * 0.0254, rel=1e-12)


def test_a_mesh_on_the_command_line_takes_tension_and_rise(mesh, capsys):
    given = ["solve", "pavilion.obj", "--units", "m", "--rise", "0.8", "-o", "a.pcmc", "--no-mesh-check"]
    assert cli.main(given) == 0
    assert "apex 0.8 m" in capsys.readouterr().out
    assert pcmc.read("a.pcmc").vertices[:, 2].max() == pytest.approx(0.8, abs=1e-6)
    assert cli.main(["solve", "pavilion.obj", "--units", "m", "--tension", "2", "--no-mesh-check"]) == 0


def test_supports_of_a_mesh_are_points_and_lines(mesh):
    side = "[[0, 0, 0], [4, 0, 0]]"
    text = f'units = "m"\n[mesh]\nfile = "pavilion.obj"\nsupports = [{side}, [0, 3, 0]]\n'
    Path("mesh.toml").write_text(text, encoding="utf-8")
    with pytest.warns(pcmc.base.errors.FileWarning):
        surface = project.build("mesh.toml")
    held = surface.vertices[surface.fixed]
    assert sorted(held[held[:, 1] > 0.1].tolist()) == [[0.0, 3.0, 0.0]]
    assert (held[:, 1] == 0.0).sum() == (surface.vertices[:, 1] == 0.0).sum()


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("supports = [[9, 9, 9]]", "mesh.supports"),
        ('supports = [["a"]]', "mesh.supports"),
        ('supports = "walls"', "mesh.supports"),
        ("patches = {rof = {tension = 1}}", "patch"),
        ("tension = -1", "mesh.tension"),
        ("rise = 0.8\npatches = {roof = {tension = 7.0}}", "mesh.patches"),
        ("tension = 2.0\npatches = {roof = {tension = 7.0}}", "mesh.tension"),
    ],
)
def test_bad_values_of_a_mesh_are_refused_in_one_line(mesh, line, what):
    Path("mesh.toml").write_text(f'[mesh]\nfile = "pavilion.obj"\n{line}\n', encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pcmc.base.errors.FileWarning)
        with refused(PcmcError, what=what):
            project.build("mesh.toml")


def test_a_mesh_elsewhere_and_none_at_all_are_refused(folder):
    for text in ('mesh = "../roof.obj"', "[mesh]\ntension = 2.0\n", 'units = "m"\n'):
        Path("mesh.toml").write_text(text, encoding="utf-8")
        with pytest.raises(FileError, match=r"^mesh\.toml"):
            project.load("mesh.toml")
