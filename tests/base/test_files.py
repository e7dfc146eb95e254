"""Several files at once: all of them new, or all as before, whatever goes wrong and when."""

from __future__ import annotations

import os

import pytest

from pcmc.base.files import atomic_writes, folder

NAMES = ("a.obj", "b.3dm", "c.glb")


@pytest.fixture
def wanted(tmp_path):
    (tmp_path / "a.obj").write_text("old a", encoding="utf-8")
    (tmp_path / "c.glb").write_text("old c", encoding="utf-8")
    return [tmp_path / name for name in NAMES]


def contents(where):
    return {p.name: p.read_text(encoding="utf-8") for p in where.iterdir()}


def write(wanted, upto=3):
    with atomic_writes(wanted) as temporaries:
        for path, temporary in list(zip(wanted, temporaries, strict=True))[:upto]:
            assert temporary.parent == path.parent
            assert temporary.suffix == path.suffix
            temporary.write_text(f"new {path.stem}", encoding="utf-8")
        if upto < 3:
            raise RuntimeError("in the middle")


def test_all_are_new(wanted, tmp_path):
    write(wanted)
    assert contents(tmp_path) == {"a.obj": "new a", "b.3dm": "new b", "c.glb": "new c"}


@pytest.mark.parametrize("upto", [0, 1, 2])
def test_an_error_while_writing_leaves_all_as_before(wanted, tmp_path, upto):
    with pytest.raises(RuntimeError, match="in the middle"):
        write(wanted, upto)
    assert contents(tmp_path) == {"a.obj": "old a", "c.glb": "old c"}


@pytest.mark.parametrize("links", [True, False], ids=["links", "copies"])
@pytest.mark.parametrize("error", [PermissionError, KeyboardInterrupt])
@pytest.mark.parametrize("done", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("name", NAMES)
def test_an_error_at_any_move_puts_all_back(wanted, tmp_path, monkeypatch, name, done, error, links):
    replace = os.replace

    def broken(source, target):
        if os.path.basename(target) == name:
            monkeypatch.setattr(os, "replace", replace)  # the way back is free
            if done:  # Ctrl-C may come just after it
                replace(source, target)
            raise error
        replace(source, target)

    def refused(*_):
        raise OSError("no links here")

    if not links:
        monkeypatch.setattr(os, "link", refused)
    monkeypatch.setattr(os, "replace", broken)
    with pytest.raises(error):
        write(wanted)
    assert contents(tmp_path) == {"a.obj": "old a", "c.glb": "old c"}


def test_a_folder_made_for_nothing_goes_again(tmp_path):
    path = tmp_path / "out" / "deep"
    with pytest.raises(ZeroDivisionError), folder(path):
        assert 1 / (not path.is_dir())
    assert list(tmp_path.iterdir()) == []
    with folder(path):
        (path / "a.obj").touch()
    with pytest.raises(RuntimeError), folder(path):
        raise RuntimeError
    assert (path / "a.obj").exists()


def test_a_name_as_long_as_a_file_system_takes_is_written(tmp_path):
    """Before, the name on the way was longer than this."""
    path = tmp_path / f"{'x' * 251}.obj"
    with atomic_writes([path]) as (temporary,):
        temporary.write_text("new", encoding="utf-8")
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
