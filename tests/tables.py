"""Comparison of tables."""

import pandas as pd


def same(a, b):
    """Equal to the last bit, missing values and column types too."""
    pd.testing.assert_frame_equal(a, b, check_exact=True)
    assert a.to_csv() == b.to_csv()
