"""Stores whose rows are sound to SQLite and to their checksums, but belong to no case of the grid."""

import json
import sqlite3
import zlib
from contextlib import closing

import pytest
from refusals import refused
from tables import same

from pcmc.base.errors import FileError, FileWarning
from pcmc.sweep import Sweep, read_store, run, table

SWEEP = Sweep("sweep_cases:chaos", {"rate": [3.7, 3.8, 3.9], "seed": [0.1, 0.2]})
DEEP = "[" * 100_000


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The bytes of a finished store, and its table."""
    path = tmp_path_factory.mktemp("store") / "s.sqlite"
    frame = run(SWEEP, path, workers=1)
    return path.read_bytes(), frame


def changed(path, data, change):
    """The store with its database changed."""
    path.write_bytes(data)
    with closing(sqlite3.connect(path)) as database:
        change(database)
        database.commit()


def rewritten(text=None, **fields):
    """Write the record of case 2 anew, with a checksum that fits."""

    def change(database):
        key, old = database.execute("SELECT parameters, record FROM cases WHERE rowid = 3").fetchone()
        new = json.dumps(json.loads(old) | fields) if text is None else text
        crc = zlib.crc32((key + new).encode())
        database.execute("UPDATE cases SET record = ?, crc = ? WHERE rowid = 3", (new, crc))

    return change


@pytest.mark.parametrize(
    "change",
    [
        rewritten(case=5),
        rewritten(parameters={"rate": 3.7, "seed": 0.1}),
        rewritten(numbers={"verdict": "stable", "x": 1.0}),
        rewritten(numbers={"rate": 9.0}),
        rewritten(numbers={"case": 0}),
        rewritten(numbers={"x": {"y": 1}}),
        rewritten(numbers=[1]),
        rewritten(numbers={"x": 10**400}),
        rewritten(status=5),
        rewritten(wall_time="long"),
        rewritten(provenance=3),
        rewritten(provenance={"case": 7}),
        rewritten("{}"),
        rewritten("{"),
        rewritten("[]"),
        rewritten("9" * 5000),
        rewritten(DEEP),
    ],
)
def test_a_record_that_its_case_cannot_have_is_run_again(tmp_path, finished, change):
    path, (data, frame) = tmp_path / "s.sqlite", finished
    changed(path, data, change)
    with pytest.warns(FileWarning, match="the record of case 2 is damaged"):
        assert [record.case for record in read_store(path)] == [0, 1, 3, 4, 5]
    with pytest.warns(FileWarning, match="the record of case 2 is damaged"):
        same(run(SWEEP, path, workers=1), frame)
    same(table(read_store(path)), frame)


@pytest.mark.parametrize(
    "key",
    ["{}", "[]", "3", DEEP, '{"rate": 3.8}', '{"rate": "3.8", "seed": 0.1}', '{"rate": 3.8, "more": 1}'],
)
def test_a_row_of_no_case_is_left_alone(tmp_path, finished, key):
    path, (data, frame) = tmp_path / "s.sqlite", finished
    changed(path, data, lambda database: database.execute("INSERT INTO cases VALUES (?, '{}', 0)", (key,)))
    same(table(read_store(path)), frame)


@pytest.mark.parametrize(
    "declaration",
    [
        "{",
        "[]",
        "{}",
        None,
        DEEP,
        '{"case": 1, "grid": {}, "fixed": {}}',
        '{"case": "a", "grid": 3, "fixed": {}}',
    ],
)
def test_a_store_that_does_not_say_its_sweep_is_refused(tmp_path, finished, declaration):
    path = tmp_path / "s.sqlite"
    changed(
        path,
        finished[0],
        lambda database: database.execute("UPDATE sweep SET declaration = ?", (declaration,)),
    )
    for use in (lambda: run(SWEEP, path, workers=1), lambda: read_store(path)):
        with refused(FileError, what=str(path), where="declaration"):
            use()


@pytest.mark.parametrize("change", ["DELETE FROM sweep", "ALTER TABLE cases ADD COLUMN more"])
def test_a_store_with_other_tables_is_refused(tmp_path, finished, change):
    path = tmp_path / "s.sqlite"
    changed(path, finished[0], lambda database: database.execute(change))
    for use in (lambda: run(SWEEP, path, workers=1), lambda: read_store(path)):
        with refused(FileError, what=str(path), where="declaration"):
            use()


def test_a_grid_of_very_many_cases_is_not_counted_through(tmp_path, finished):
    path, (data, _) = tmp_path / "s.sqlite", finished
    grid = {f"a{k}": list(range(100)) for k in range(20)}  # 10^40 cases
    text = json.dumps({"case": SWEEP.case, "grid": grid, "fixed": {}})
    changed(path, data, lambda database: database.execute("UPDATE sweep SET declaration = ?", (text,)))
    assert read_store(path) == []
