"""Errors asked for by their type and fields, so that a better sentence breaks no test."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def refused(kind: type[Exception], **fields: object) -> Iterator[pytest.ExceptionInfo]:
    """The block raises an error of this kind whose ``what``, ``where``, ``found``, ``expected`` are these."""
    with pytest.raises(kind) as caught:
        yield caught
    for name, value in fields.items():
        assert getattr(caught.value, name) == value, f"{name}: {caught.value}"
