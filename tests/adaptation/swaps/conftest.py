"""The system of the tests of swaps."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.adaptation.swaps.relaying import relaying
from tests.adaptation.system import System


@pytest.fixture
def site(tmp_path: Path) -> Iterator[System]:
    """A source, a totaller that adds up what it says, a sink that checks, and a manager."""
    with relaying(tmp_path) as system:
        yield system
