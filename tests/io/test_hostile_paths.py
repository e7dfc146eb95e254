"""Paths that are no files, places that cannot be written, encodings and line ends of other systems."""

from __future__ import annotations

import os

import numpy as np
import pytest
from refusals import refused

import pcmc
from pcmc import cli
from pcmc.base.errors import FileError
from pcmc.io import FORMATS
from pcmc.project import load
from pcmc.project.writing import check_outputs
from tests.io.test_hostile_files import TRIANGLE, V, ply
from tests.io.test_io_foreign import expected

SUFFIXES = [*FORMATS, ".toml"]
READ = [suffix for suffix, form in FORMATS.items() if form.reads]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_pipes_and_devices_are_not_opened(tmp_path, suffix, capsys):
    os.mkfifo(tmp_path / f"pipe{suffix}")
    (tmp_path / f"device{suffix}").symlink_to("/dev/zero")
    for name in ("pipe", "device"):
        path, project = tmp_path / f"{name}{suffix}", tmp_path / "roof.toml"
        project.write_text(f'mesh = "{path.name}"\n')
        for file in (path, project) if suffix in READ else (path,):
            assert cli.main(["certify", str(file)]) == 2
            assert capsys.readouterr().err.count("is no regular file but a pipe or a device") == 1


def test_pipes_and_devices_are_not_written_over(tmp_path):
    os.mkfifo(tmp_path / "pipe.obj")
    (tmp_path / "device.obj").symlink_to("/dev/zero")
    for name in ("pipe.obj", "device.obj"):
        with refused(FileError, what=str(tmp_path / name)) as caught:
            check_outputs([tmp_path / name])
        assert str(caught.value).endswith("is a pipe or a device; name a file")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_paths_that_no_file_can_have(tmp_path, suffix):
    read = load if suffix == ".toml" else pcmc.read
    (tmp_path / f"folder{suffix}").mkdir()
    (tmp_path / f"loop{suffix}").symlink_to(tmp_path / f"loop{suffix}")
    for name in ("a\0b", "a" * 300, "folder", "loop", "missing", "missing/a"):
        path = tmp_path / f"{name}{suffix}"
        with refused(FileError, what=str(path)) as caught:
            read(path)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", FORMATS)
def test_places_that_cannot_be_written(tmp_path, suffix):
    (tmp_path / f"folder{suffix}").mkdir()
    for name in ("a\0b", "a" * 300, "folder", "missing/a"):
        path = tmp_path / f"{name}{suffix}"
        with refused(FileError, what=str(path)):
            pcmc.write(path, expected())
    assert [p.name for p in tmp_path.iterdir()] == [f"folder{suffix}"]


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_that_the_disk_has_no_room_for_is_not_there(tmp_path, suffix):
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    surface = expected()
    pcmc.write(tmp_path / f"a{suffix}", surface)  # its module is compiled by now
    (tmp_path / f"a{suffix}").unlink()
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, hard))
    try:
        with pytest.raises(FileError) as caught:
            pcmc.write(tmp_path / f"a{suffix}", surface)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


# ---- encodings


@pytest.mark.parametrize(
    ("suffix", "change"),
    [(".obj", "mark"), (".fe", "mark"), (".obj", "lines"), (".fe", "lines"), (".ply", "lines")],
)
def test_marks_and_line_ends_of_windows_change_nothing(tmp_path, suffix, change):
    """A byte-order mark before the first vertex must not lose it."""
    path = tmp_path / f"a{suffix}"
    pcmc.write(path, expected())
    data = {
        ".obj": (V + "f 1 2 5\nf 2 3 5\n").encode(),
        ".fe": path.read_bytes(),
        ".ply": ply(TRIANGLE + b"3 0 1 2\n"),
    }[suffix]
    path.write_bytes(data)
    before = pcmc.io.load(path)
    path.write_bytes(b"\xef\xbb\xbf" + data if change == "mark" else data.replace(b"\n", b"\r\n"))
    after = pcmc.io.load(path)
    np.testing.assert_array_equal(after.vertices, before.vertices)
    np.testing.assert_array_equal(after.faces, before.faces)


@pytest.mark.parametrize("suffix", [".obj", ".fe"])
def test_other_encodings_are_named(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    pcmc.write(path, expected())
    path.write_bytes(path.read_text(encoding="utf-8").encode("utf-16"))
    with refused(FileError, what=str(path)) as caught:
        pcmc.read(path)
    assert "\n" not in str(caught.value)
