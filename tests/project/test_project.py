"""Project files: a whole design from one file, solved, remeshed, at its targets; all output or none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from small_project import changed

import pcmc
from pcmc.base.errors import FileError, OptionError, PcmcError
from pcmc.project import build, run
from pcmc.project.checking import line_with
from pcmc.project.settings import check_names
from pcmc.project.writing import check_outputs

ROOF = Path(__file__).resolve().parents[2] / "notebooks" / "roof.toml"


def test_the_example_gives_certified_files_and_a_picture(tmp_path):
    assert len(ROOF.read_text(encoding="utf-8").splitlines()) <= 30
    steps = []
    outcome = run(ROOF, tmp_path / "out", steps.append)
    assert outcome.good
    assert outcome.certificate.verdict is pcmc.Verdict.STABLE
    found = sorted(p.name for p in (tmp_path / "out").iterdir())
    assert found == ["roof.3dm", "roof.glb", "roof.obj", "roof.png"]
    assert sorted(p.name for p in outcome.files) == found
    names = [p.name for p in outcome.surface.patches]
    assert names == ["corner", "north", "east", "wall 1", "wall 2", "wall 3"]
    for name in ("roof.3dm", "roof.obj", "roof.glb"):
        back = pcmc.read(tmp_path / "out" / name)
        assert sorted(p.name for p in back.patches) == sorted(names)
        assert back.m == outcome.surface.m
    assert {s.split()[0] for s in steps} >= {"meshing", "solving:", "certifying", "writing"}


def test_the_native_file_keeps_supports_and_tensions(small):
    outcome = run(small)
    back = pcmc.read(small.parent / "roof.pcmc")
    assert back.patches == outcome.surface.patches
    assert (back.fixed == outcome.surface.fixed).all()
    assert pcmc.certify(back).certified


def test_build_only_meshes(small):
    assert pcmc.certify(build(small)).verdict is pcmc.Verdict.NOT_CONVERGED
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]


def test_a_crossing_outline_names_the_file(small):
    changed(small, "[4, 3], [0, 3]", "[0, 3], [4, 3]")
    with pytest.raises(pcmc.base.errors.PlanError, match=r"small\.toml: "):
        build(small)


def test_nothing_is_written_when_a_later_file_fails(small, monkeypatch):
    (small.parent / "roof.pcmc").write_text("as before", encoding="utf-8")
    from pcmc.io import obj

    def broken(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(obj, "write", broken)
    with pytest.raises(FileError, match=r"roof\.obj: cannot be written \(No space left"):
        run(small)
    assert sorted(p.name for p in small.parent.iterdir()) == ["roof.pcmc", "small.toml"]
    assert (small.parent / "roof.pcmc").read_text(encoding="utf-8") == "as before"


def test_nothing_is_written_when_not_certified_unless_asked(small):
    changed(small, "tension = 2.0", "tension = 0.3")
    outcome = run(small)
    assert not outcome.good
    assert outcome.files == ()
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]
    assert len(run(small, anyway=True).files) == 2


def test_output_names_are_checked_before_any_work(tmp_path):
    (tmp_path / "a.obj").mkdir()
    with pytest.raises(FileError, match="is a folder; give the name of a file"):
        check_outputs([tmp_path / "a.obj"])
    with pytest.raises(FileError, match="named twice"):
        check_outputs([tmp_path / "b.obj", tmp_path / "b.obj"])
    with pytest.raises(FileError, match=r"B\.OBJ: is named twice \(capitals count as small letters\)"):
        check_outputs([tmp_path / "b.obj", tmp_path / "B.OBJ"])
    with refused(FileError, what="b.obk", found=".obk"):
        check_names(["b.obk"])
    with pytest.raises(FileError, match=r"b.png: .*a picture has its own option"):
        check_names(["b.png"])
    with refused(FileError, what="b.jpg", found=".jpg", expected=(".png", ".svg", ".pdf")):
        check_names([], "b.jpg")
    with pytest.raises(FileError, match="there is no folder"):
        check_outputs([tmp_path / "away" / "b.obj"])
    check_outputs([tmp_path / "away" / "b.obj"], tmp_path / "away")


def test_a_file_that_is_read_only_is_not_replaced(tmp_path, monkeypatch):
    """Before, it was: the folder alone was looked at."""
    (tmp_path / "b.obj").write_text("kept", encoding="utf-8")
    monkeypatch.setattr("os.access", lambda path, mode: path.is_dir())
    with pytest.raises(FileError, match=r"b\.obj: is there and read-only; name another file"):
        check_outputs([tmp_path / "b.obj"])


def test_a_folder_that_may_not_be_written_to_is_refused_before_any_work(small, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    monkeypatch.setattr("pcmc.project.designing.start_of", None)
    with pytest.raises(FileError, match="is read-only"):
        run(small)
    with pytest.raises(FileError, match="is read-only"):
        run(small, small.parent / "new" / "one")
    with pytest.raises(FileError, match=r"small.toml is a file; the output needs a folder"):
        run(small, small / "new")
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]


def test_a_folder_that_is_not_there(small):
    changed(small, '"roof.obj"', '"away/roof.obj"')
    with pytest.raises(FileError, match="there is no folder"):
        run(small)
    assert [p.name for p in small.parent.iterdir()] == ["small.toml"]


REMESH = "[remesh]\nedge_length = 0.5\n\n[output]"


@pytest.mark.parametrize("when", ["before", "after"])
def test_remeshed_before_or_after_and_certified_anew(small, when):
    coarse = build(small)
    changed(small, "[output]", REMESH.replace("0.5", f'0.5\nwhen = "{when}"'))
    steps = []
    outcome = run(small, progress=steps.append)
    assert outcome.good
    assert outcome.surface.m > 2.5 * coarse.m
    assert [p.name for p in outcome.surface.patches] == ["roof"]
    back = pcmc.read(small.parent / "roof.pcmc")
    assert back.m == outcome.surface.m
    assert pcmc.certify(back).certified
    solved = [k for k, step in enumerate(steps) if step.startswith("solving")]
    remeshed = steps.index("remeshing")
    assert (solved[0] < remeshed) == (when == "after")
    assert remeshed < solved[-1]


def test_remeshed_twice_with_solves_between_and_finer_at_the_curves(small):
    twice = "[[remesh]]\nedge_length = 0.7\n[[remesh]]\nedge_length = 0.7\nnear_curves = 0.25\n[output]"
    steps = []
    outcome = run(changed(small, "[output]", twice), progress=steps.append)
    assert steps.count("remeshing") == 2
    assert steps.count("certifying") == 3
    surface = outcome.surface
    ends = surface.vertices[surface.topology.edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    rim = surface.topology.boundary_edge
    assert length[rim].max() < 0.3
    assert length[~rim].max() > 0.5


def test_targets_are_met_on_the_new_mesh_too(small):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "roof", value = 0.6}]\nvary = ["roof"]\n'
    outcome = run(changed(small, "[output]", aim + REMESH))
    assert outcome.good
    assert outcome.surface.m > 100
    assert outcome.surface.vertices[:, 2].max() == pytest.approx(0.6, abs=1e-6)


def test_what_is_not_certified_is_not_remeshed(small):
    changed(small, "tension = 2.0", "tension = 0.3")
    steps = []
    assert not run(changed(small, "[output]", REMESH), progress=steps.append).good
    assert "remeshing" not in steps


def test_targets_are_met(small):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "roof", value = 0.6}]\nvary = ["roof"]\n\n[output]'
    outcome = run(changed(small, "[output]", aim))
    assert outcome.design is not None
    assert outcome.good
    assert outcome.surface.vertices[:, 2].max() == pytest.approx(0.6, abs=1e-6)
    assert pcmc.read(small.parent / "roof.pcmc").patches == outcome.surface.patches


def test_targets_for_a_patch_that_is_not_there_and_another_method(small):
    aim = '[targets]\nmeet = [{quantity = "apex", of = "rof", value = 0.6}]\nvary = ["roof"]\n[output]'
    changed(small, "[output]", aim)
    with pytest.raises(OptionError, match=r"small\.toml: line 11: unknown patch 'rof'; did you mean 'roof'"):
        run(small)
    changed(small, '"newton"', '"lbfgs"')
    with refused(OptionError, what="solve.method", found="lbfgs"):
        run(small)


def test_a_bad_value_has_its_line(small):
    changed(small, "tension = 2.0", "tension = -5.0")
    number = next(k for k, line in enumerate(small.read_text().splitlines(), 1) if "-5.0" in line)
    with pytest.raises(PcmcError, match=rf"small\.toml: line {number}: tension of .*found -5"):
        build(small)
    small.write_text(
        small.read_text() + "# twice: -5.0\n[targets]\nmeet = [{quantity = 'apex', value = -5.0}]\n"
    )
    assert line_with(small, -5.0) == 0
    assert line_with(small, "apex") == len(small.read_text().splitlines())
