"""The designed roof of a project: what commands show of it, and the cache that keeps it."""

from __future__ import annotations

import re
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from nightly import at_night
from small_project import SMALL

import pcmc
from pcmc import cli, explore
from pcmc.base.units import Units
from pcmc.certificate.quantities import QUANTITIES, dimension_of
from pcmc.design.targets import KINDS, MEASURES
from pcmc.explore.page_data import unit_texts
from pcmc.io.mesh_data import scaled_surface
from pcmc.project import build, cached_files, clear_cache, designed, designing, load, run

GOAL = """
[targets]
meet = [{quantity = "apex", of = "roof", value = %s}]
vary = ["roof"]
[remesh]
edge_length = 0.8
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a project that has a target and a remeshing, and a cache of its own."""
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    monkeypatch.setenv("PCMC_CACHE", str(tmp_path / "cache"))
    (work / "roof.toml").write_text(SMALL.split("[output]")[0] + GOAL % 0.6, encoding="utf-8")
    (work / "high.toml").write_text(SMALL.split("[output]")[0] + GOAL % 9.0, encoding="utf-8")
    return work


def solves(monkeypatch):
    """The list that every project solved from its start is added to."""
    solved = []
    solve = designing.solve_project
    monkeypatch.setattr(designing, "solve_project", lambda *given: solved.append(given) or solve(*given))
    return solved


def test_it_meets_its_targets_on_the_new_mesh(folder):
    roof = designed("roof.toml")
    assert roof.good
    assert not roof.cached
    assert roof.surface.vertices[:, 2].max() == pytest.approx(0.6, abs=1e-6)
    assert roof.surface.m > build("roof.toml").m


def test_the_second_time_it_is_the_same_to_the_last_bit_and_not_solved(folder, monkeypatch):
    first = designed("roof.toml")
    solved = solves(monkeypatch)
    second = designed("roof.toml")
    assert second.cached
    assert second.good
    assert not solved
    for name in ("vertices", "faces", "patch_of_face", "fixed", "on_plane"):
        np.testing.assert_array_equal(getattr(first.surface, name), getattr(second.surface, name))
    assert first.surface.patches == second.surface.patches
    assert first.surface.plane == second.surface.plane
    assert first.result.message == second.result.message
    assert first.design.message == second.design.message
    for name in ("targets", "parameters"):
        assert getattr(first.design, name).equals(getattr(second.design, name))
    assert second.certificate.certified


def test_solving_a_project_fills_the_cache(folder):
    assert cli.main(["solve", "roof.toml"]) == 0
    assert designed("roof.toml").cached
    clear_cache()
    assert cli.main(["solve", "roof.toml", "--tension", "2.5"]) in (0, 1)  # another roof
    assert cli.main(["solve", "roof.toml", "--no-cache"]) == 0
    assert not cached_files()
    assert run("roof.toml").good
    assert designed("roof.toml").cached


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[4, 3]", "[4, 3.001]"),
        ("value = 0.6", "value = 0.61"),
        *at_night(
            ('method = "newton"', "tolerance = 1e-11"),
            ("edge_length = 1.0", "edge_length = 0.9"),
            ("tension = 2.0", "tension = 2.1"),
            ("[targets]", "[targets]\ntolerance = 1e-5"),
            ("edge_length = 0.8", "edge_length = 0.7"),
        ),
    ],
)
def test_another_content_is_another_roof(folder, old, new):
    before = load("roof.toml")
    designed(before)
    text = (folder / "roof.toml").read_text(encoding="utf-8")
    assert old in text
    (folder / "roof.toml").write_text(text.replace(old, new), encoding="utf-8")
    after = designed("roof.toml")
    assert not after.cached
    assert designed(before).cached


def test_comments_output_and_units_leave_the_roof_as_it_is(folder):
    designed("roof.toml")
    text = 'units = "m"\n# a comment\n' + (folder / "roof.toml").read_text(encoding="utf-8")
    (folder / "other.toml").write_text(text + '[output]\nfiles = ["a.obj"]\n', encoding="utf-8")
    roof = designed("other.toml")
    assert roof.cached
    assert roof.units.length == "m"


@pytest.mark.parametrize("damage", ["cut", "surface", *at_night("flipped", "empty", "other")])
def test_a_damaged_file_is_made_anew(folder, damage):
    first = designed("roof.toml").surface
    (path,) = cached_files()
    data = path.read_bytes()
    if damage == "cut":
        path.write_bytes(data[: len(data) // 2])
    elif damage == "flipped":
        path.write_bytes(data[:300] + bytes([data[300] ^ 255]) + data[301:])
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "other":
        path.write_text("not a roof", encoding="utf-8")
    else:  # a surface, but no roof of a project
        pcmc.write(path, first)
    again = designed("roof.toml")
    assert not again.cached
    np.testing.assert_array_equal(again.surface.vertices, first.vertices)
    assert designed("roof.toml").cached


def test_the_cache_can_be_switched_off_and_need_not_be_writable(folder, monkeypatch):
    designed("roof.toml", use_cache=False)
    assert not cached_files()
    monkeypatch.setenv("PCMC_CACHE", str(folder / "roof.toml"))  # no folder
    assert designed("roof.toml").good
    assert not designed("roof.toml").cached


def test_a_cache_that_is_off_has_no_roof(folder, monkeypatch):
    monkeypatch.setenv("PCMC_CACHE", "off")
    assert designed("roof.toml").good
    assert not designed("roof.toml").cached


def test_the_oldest_roofs_go_first(folder, monkeypatch):
    monkeypatch.setattr("pcmc.project.cache.MOST", 2)
    project = replace(load("roof.toml"), targets=(), vary=(), remeshing=())
    variants = [replace(project, options={"tolerance": 10.0**-k}) for k in (9, 10, 11)]
    for variant in variants[:2]:
        designed(variant)
    designed(variants[0])  # used last
    designed(variants[2])
    assert [designed(variant).cached for variant in (variants[0], variants[2])] == [True, True]
    assert not designed(variants[1]).cached


def test_a_roof_that_misses_its_target_is_not_kept(folder, monkeypatch):
    assert not designed("high.toml").good
    assert not cached_files()
    solved = solves(monkeypatch)
    assert not designed("high.toml").good
    assert len(solved) == 1


@pytest.mark.parametrize("command", [["convert", "roof.toml", "a.pcmc"], ["plot", "roof.toml", "a.png"]])
def test_commands_show_the_designed_roof(folder, capsys, command):
    assert cli.main(command) == 0
    assert "targets met" in capsys.readouterr().out
    assert (folder / command[2]).exists()
    if command[0] == "convert":
        roof = pcmc.read("a.pcmc")
        assert roof.vertices[:, 2].max() == pytest.approx(0.6, abs=1e-6)
        assert pcmc.certify(roof).certified
    assert cli.main(command) == 0
    assert "solved before" in capsys.readouterr().out


def test_targets_are_shown_in_their_units(folder, capsys):
    text = 'units = "ft"\nforce = "kip"\n' + (folder / "roof.toml").read_text(encoding="utf-8")
    (folder / "feet.toml").write_text(text, encoding="utf-8")
    assert cli.main(["certify", "feet.toml"]) == 0
    out = capsys.readouterr().out
    assert "apex of roof 0.6 ft, with tension of roof " in out
    assert " kip/ft\n" in out
    assert "lengths in ft" in out


def test_every_quantity_of_a_target_has_a_unit():
    page = Path(explore.__file__).with_name("page") / "targets.js"
    kinds = dict(re.findall(r"(\w+): \"(\w+)\"", page.read_text(encoding="utf-8").partition("};")[0]))
    assert kinds == {quantity: dimension_of(quantity) for quantity in kinds}
    assert set(kinds.values()) <= set(unit_texts(Units("m", "kN")))
    assert set(MEASURES) <= set(QUANTITIES)
    for quantity in {*QUANTITIES, *KINDS}:
        assert getattr(Units("m", "kN"), dimension_of(quantity))


def test_the_start_shape_has_a_flag_of_its_own(folder, capsys):
    assert cli.main(["convert", "roof.toml", "a.pcmc", "--start"]) == 0
    np.testing.assert_array_equal(pcmc.read("a.pcmc").vertices, build("roof.toml").vertices)
    assert cli.main(["certify", "roof.toml", "--start"]) == 1
    assert "not converged" in capsys.readouterr().out
    assert cli.main(["plot", "roof.toml", "a.png", "--start"]) == 0
    assert not cached_files()


def test_certify_judges_the_designed_roof(folder, capsys):
    assert cli.main(["certify", "roof.toml"]) == 0
    out = capsys.readouterr().out
    assert "Morse index  0" in out
    assert "targets met" in out
    assert cli.main(["certify", "high.toml"]) == 1  # stable, but its target is missed
    assert "out of reach" in capsys.readouterr().out


@pytest.mark.parametrize("command", [["convert", "high.toml", "a.obj"], ["plot", "high.toml", "a.png"]])
def test_a_missed_target_writes_nothing(folder, capsys, command):
    assert cli.main(command) == 1
    out = capsys.readouterr().out
    assert "out of reach" in out
    assert "nothing written" in out
    assert "--start" in out
    assert not (folder / command[2]).exists()


def test_other_tensions_are_solved_and_not_kept(folder):
    assert cli.main(["convert", "roof.toml", "a.pcmc"]) == 0
    (folder / "plain.toml").write_text(SMALL, encoding="utf-8")
    assert cli.main(["convert", "plain.toml", "b.pcmc", "--tension", "roof=2.5"]) == 0
    assert pcmc.read("b.pcmc").patches[0].tension == 2.5
    assert pcmc.certify(pcmc.read("b.pcmc")).certified
    assert len(cached_files()) == 1


def test_explore_opens_the_designed_roof_also_if_it_misses_its_target(folder, monkeypatch, capsys):
    shown = []
    monkeypatch.setattr("pcmc.cli.files.start", lambda *given, watch: (*given, watch))
    monkeypatch.setattr("pcmc.cli.files.open_and_wait", lambda given, page: shown.append(given[0].surface))
    for name in ("roof.toml", "high.toml"):
        assert cli.main(["explore", name, "--no-browser"]) == 0
    assert shown[0].vertices[:, 2].max() == pytest.approx(0.6, abs=1e-6)
    assert pcmc.certify(shown[1]).certified
    assert "out of reach" in capsys.readouterr().out
    assert cli.main(["explore", "roof.toml", "--no-browser", "--start"]) == 0
    np.testing.assert_array_equal(shown[2].vertices, build("roof.toml").vertices)


@pytest.mark.parametrize("kind", ["SIGINT", "SIGTERM"])
def test_ctrl_c_is_130_and_keeps_nothing(folder, monkeypatch, capsys, kind):
    meet = pcmc.meet

    def pressed(*given, callback, **options):
        def stop(row):
            signal.raise_signal(getattr(signal, kind))

        return meet(*given, callback=stop, **options)

    monkeypatch.setattr("pcmc.project.solving.meet", pressed)
    for command in (["convert", "roof.toml", "a.obj"], ["certify", "roof.toml"], ["explore", "roof.toml"]):
        assert cli.main(command) == 130
        assert capsys.readouterr() == ("", "pcmc: stopped\n")
    assert not (folder / "a.obj").exists()
    assert not cached_files()


def test_the_command_shows_and_clears_the_cache(folder, capsys, monkeypatch):
    assert cli.main(["cache"]) == 0
    assert capsys.readouterr().out.startswith("0 roofs in ")
    designed("roof.toml")
    assert cli.main(["cache"]) == 0
    assert capsys.readouterr().out.startswith("1 roofs in ")
    assert cli.main(["cache", "--clear"]) == 0
    assert capsys.readouterr().out.startswith("1 roofs removed from ")
    assert not cached_files()
    monkeypatch.setenv("PCMC_CACHE", "off")
    assert cli.main(["cache"]) == 0
    assert "no roofs are kept" in capsys.readouterr().out


def test_a_copy_of_the_project_elsewhere_has_the_same_roof(folder, tmp_path):
    designed("roof.toml")
    shutil.copy("roof.toml", tmp_path / "copy.toml")
    assert designed(tmp_path / "copy.toml").cached


def test_files_of_others_in_the_folder_of_the_cache_stay(folder, monkeypatch, capsys):
    monkeypatch.setenv("PCMC_CACHE", str(folder))
    assert cli.main(["solve", "roof.toml", "--no-mesh-check", "-o", "mine.pcmc"]) == 0
    assert len(cached_files()) == 1
    assert cli.main(["cache", "--clear"]) == 0
    assert "1 roofs removed" in capsys.readouterr().out
    assert [path.name for path in folder.glob("*.pcmc")] == ["mine.pcmc"]


@pytest.mark.parametrize("when", ["before", "meanwhile"])
def test_a_roof_is_kept_for_the_mesh_that_was_read(folder, monkeypatch, when):
    """A mesh may be exported anew while it is solved."""
    surface = build("roof.toml")
    pcmc.write("mesh.obj", surface)
    Path("of_mesh.toml").write_text('[mesh]\nfile = "mesh.obj"\nrise = 0.6\n', encoding="utf-8")
    first, solve = designed("of_mesh.toml", use_cache=False), designing.solve_project

    def solved(*given):
        done = solve(*given)
        pcmc.write("mesh.obj", scaled_surface(surface, 1.5))
        return done

    if when == "meanwhile":
        monkeypatch.setattr(designing, "solve_project", solved)
    designed("of_mesh.toml")
    again = designed("of_mesh.toml")
    assert again.cached == (when == "before")
    assert again.surface.size == pytest.approx((1.0 if again.cached else 1.5) * first.surface.size, rel=0.01)
    assert [target.label for target in again.project.targets] == ["apex"]
