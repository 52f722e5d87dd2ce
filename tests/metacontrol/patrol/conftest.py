"""The patrol, running."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.metacontrol.patrol.running import Patrol


@pytest.fixture
def patrol(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Patrol]:
    """Return the patrol under the real clock."""
    monkeypatch.setenv("REGRAFT_HOME", str(tmp_path / "home"))
    made = Patrol(tmp_path)
    try:
        yield made
    finally:
        made.end()
