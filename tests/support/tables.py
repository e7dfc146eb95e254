"""Comparison of tables, and a look into the store of a sweep."""

import sqlite3
from contextlib import closing

import pandas as pd


def same(a, b):
    """Equal to the last bit, missing values and column types too."""
    pd.testing.assert_frame_equal(a, b, check_exact=True)
    assert a.to_csv() == b.to_csv()


def last_row(store):
    """The number of the last row written to a store: one more than the rows, if a case was written twice."""
    with closing(sqlite3.connect(store)) as database:
        return database.execute("SELECT max(rowid) FROM cases").fetchone()[0]
