"""The store of a sweep: grown, damaged, foreign."""

import os
import sqlite3
from contextlib import closing

import pytest
import sweep_cases
from refusals import refused
from tables import same

from pcmc.base.errors import FileError, FileWarning
from pcmc.sweep import Sweep, read_store, run, table
from pcmc.sweep import store as store_module
from pcmc.sweep.store import open_store

SWEEP = Sweep("sweep_cases:chaos", {"rate": [3.7, 3.8, 3.9], "seed": [0.1, 0.2]})


@pytest.fixture
def stored(tmp_path):
    """A finished store, its bytes and its table."""
    path = tmp_path / "stored.sqlite"
    frame = run(SWEEP, path, workers=1)
    return path, path.read_bytes(), frame


def change(path, statement):
    """Change the database itself."""
    with closing(sqlite3.connect(path)) as database:
        database.execute(statement)
        database.commit()


def run_cases(sweep, path, **options):
    """The table, and the parameters of the cases that were run for it."""
    seen = []
    frame = run(sweep, path, workers=1, on_record=seen.append, **options)
    return frame, [dict(progress.record.parameters) for progress in seen]


# ---- a grid that changes


def test_values_added_to_the_grid_run_only_their_cases(stored):
    path, _, frame = stored
    larger = Sweep(SWEEP.case, {"rate": [3.6, 3.7, 3.8, 3.9], "seed": [0.1, 0.2, 0.3]})
    grown, ran = run_cases(larger, path)
    assert ran == [case for case in larger if case["rate"] == 3.6 or case["seed"] == 0.3]
    same(grown, run(larger, workers=1))
    same(table(read_store(path)), grown)
    old = grown[grown["rate"].isin([3.7, 3.8, 3.9]) & grown["seed"].isin([0.1, 0.2])]
    assert old["x"].tolist() == frame["x"].tolist()


def test_values_taken_from_the_grid_stay_in_the_store(stored):
    path, _, frame = stored
    smaller = Sweep(SWEEP.case, {"rate": [3.8], "seed": [0.2, 0.1]})
    part, ran = run_cases(smaller, path)
    assert ran == []
    assert part["x"].tolist() == [frame.loc[3, "x"], frame.loc[2, "x"]]
    same(table(read_store(path)), part)
    again, ran = run_cases(SWEEP, path)
    assert ran == []
    same(again, frame)


def test_the_order_of_axes_and_values_does_not_matter(stored):
    path, _, _ = stored
    turned = Sweep(SWEEP.case, {"seed": [0.2, 0.1], "rate": [3.9, 3.7, 3.8]})
    frame, ran = run_cases(turned, path)
    assert ran == []
    same(frame, run(turned, workers=1))


def test_equal_numbers_of_other_types_are_other_cases(tmp_path):
    path = tmp_path / "s.sqlite"
    run(Sweep(sweep_cases.echo, {"value": [1, {"a": 1, "b": 2}]}), path, workers=1)
    more = Sweep(sweep_cases.echo, {"value": [1.0, True, "1", 1, {"b": 2, "a": 1}]})
    frame, ran = run_cases(more, path)
    assert [case["value"] for case in ran] == [1.0, True, "1"]
    assert frame["type"].tolist() == ["float", "bool", "str", "int", "dict"]


def test_a_store_is_one_file_while_nothing_is_written(stored, tmp_path):
    path, _, _ = stored
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    with open_store(path, SWEEP):
        assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_store_can_be_read_while_its_sweep_runs(tmp_path):
    path, seen = tmp_path / "s.sqlite", []
    run(SWEEP, path, workers=1, on_record=lambda p: seen.append((p.done, len(read_store(path)))))
    assert [done for done, _ in seen] == [1, 2, 3, 4, 5, 6]
    assert all(done <= read for done, read in seen)  # a record is stored before it is shown


# ---- stores that are damaged, or of something else


def test_a_damaged_record_is_run_again(stored):
    path, _, frame = stored
    change(path, "UPDATE cases SET record = replace(record, '0', '1') WHERE rowid = 3")
    with pytest.warns(FileWarning, match="the record of case 2 is damaged"):
        assert [record.case for record in read_store(path)] == [0, 1, 3, 4, 5]
    with pytest.warns(FileWarning, match="the record of case 2 is damaged"):
        again, ran = run_cases(SWEEP, path)
    assert ran == [list(SWEEP)[2]]
    same(again, frame)


def test_a_record_moved_to_another_case_is_not_believed(stored):
    path, _, frame = stored
    change(path, "DELETE FROM cases WHERE rowid = 2")
    change(path, """UPDATE cases SET parameters = '{"rate": 3.7, "seed": 0.2}' WHERE rowid = 5""")
    with pytest.warns(FileWarning, match="the record of case 1 is damaged"):
        again, ran = run_cases(SWEEP, path)
    assert ran == [list(SWEEP)[1], list(SWEEP)[4]]
    same(again, frame)


@pytest.mark.parametrize("part", [0.2, 0.5, 0.9])
def test_a_cut_store_is_refused_and_kept(part, stored):
    path, data, _ = stored
    path.write_bytes(data[: int(part * len(data))])
    cut = path.read_bytes()
    for use in (lambda: run(SWEEP, path, workers=1), lambda: read_store(path)):
        with refused(FileError, what=str(path)):
            use()
    assert path.read_bytes() == cut


@pytest.mark.parametrize(
    ("other", "fields"),
    [
        (
            Sweep(SWEEP.case, {"rate": [3.7], "seed": [0.1], "pause": [0.0]}),
            {"where": "pause", "found": "missing", "expected": "varied"},
        ),
        (Sweep(SWEEP.case, {"rate": [3.7]}, {"seed": 0.1}), {"where": "seed", "found": "varied"}),
        (Sweep(SWEEP.case, SWEEP.grid, {"pause": 0.1}), {"where": "pause", "expected": 0.1}),
        (Sweep("sweep_cases:anything", SWEEP.grid), {"where": "case", "found": SWEEP.case}),
    ],
)
def test_another_sweeps_store_is_refused_and_kept(other, fields, stored):
    path, data, _ = stored
    with refused(FileError, what=str(path), **fields):
        run(other, path, workers=1)
    assert path.read_bytes() == data


def test_another_versions_store_is_refused_and_kept(stored, monkeypatch):
    path, data, _ = stored
    monkeypatch.setattr(store_module, "version", lambda package: "99.0")
    with refused(FileError, what=str(path), where="version", expected="99.0"):
        run(SWEEP, path, workers=1)
    monkeypatch.undo()
    monkeypatch.setattr(store_module, "FORMAT", 99)
    for use in (lambda: run(SWEEP, path, workers=1), lambda: read_store(path)):
        with refused(FileError, what=str(path), found=2, expected=99):
            use()
    assert path.read_bytes() == data


@pytest.mark.parametrize("text", [b"a,b\n1,2\n", b'{"pcmc sweep": 1}\n', b"\xff\xfe", b"SQLite format 4\0"])
def test_a_file_that_is_no_store_is_refused_and_kept(text, tmp_path):
    path = tmp_path / "mine.csv"
    path.write_bytes(text)
    for use in (lambda: run(SWEEP, path, workers=1), lambda: read_store(path)):
        with pytest.raises(FileError, match="is not the store of a sweep; name another file"):
            use()
    assert path.read_bytes() == text


def test_a_database_of_another_program_is_refused_and_kept(tmp_path):
    path = tmp_path / "photos.db"
    change(path, "CREATE TABLE photos (name TEXT)")
    data = path.read_bytes()
    for use in (lambda: run(SWEEP, path, workers=1), lambda: read_store(path)):
        with pytest.raises(FileError, match="is not the store of a sweep; name another file"):
            use()
    assert path.read_bytes() == data


def test_an_empty_file_becomes_a_store(tmp_path):
    """A sweep that was killed at its very start leaves one."""
    path = tmp_path / "s.sqlite"
    path.touch()
    with refused(FileError, what=str(path)):
        read_store(path)
    assert len(run(SWEEP, path, workers=1)) == len(read_store(path)) == 6


def test_paths_that_cannot_be_opened(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(FileError, match="cannot be opened"):
        run(SWEEP, tmp_path / "file" / "s.sqlite", workers=1)
    with pytest.raises(FileError, match=r"cannot be opened \(File name too long\)"):
        run(SWEEP, tmp_path / ("x" * 300), workers=1)
    with pytest.raises(FileError, match="cannot have the character NUL"):
        run(SWEEP, "a\0b", workers=1)
    with pytest.raises(FileError, match="cannot be read"):
        read_store(tmp_path / "missing.sqlite")
    assert not (tmp_path / "missing.sqlite").exists()


def test_names_with_odd_characters(tmp_path):
    path = tmp_path / "a?mode=memory#50%25 ö.sqlite"
    frame = run(SWEEP, path, workers=1)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    same(table(read_store(path)), frame)


def test_folders_pipes_and_devices_are_no_stores(tmp_path):
    """A device may be read without end, a pipe waits for somebody to write."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (tmp_path, pipe, "/dev/zero"):
        for use in (lambda path=path: run(SWEEP, path, workers=1), lambda path=path: read_store(path)):
            with pytest.raises(FileError, match="is no regular file"):
                use()
