"""What several tests of sweeps start from."""

from __future__ import annotations

import pytest
from swept_roof import TEXT


@pytest.fixture
def roof(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "roof.toml").write_text(TEXT, encoding="utf-8")
    return tmp_path / "roof.toml"
