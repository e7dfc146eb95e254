"""What several tests of sweeps start from."""

from __future__ import annotations

import os

import pytest
from swept_roof import TEXT


@pytest.fixture
def roof(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if hasattr(os, "sched_getaffinity"):  # one process a sweep: each imports the package anew
        monkeypatch.setattr(os, "sched_getaffinity", lambda pid: {0})
    (tmp_path / "roof.toml").write_text(TEXT, encoding="utf-8")
    return tmp_path / "roof.toml"
