"""A small running system for every test that asks for one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.adaptation.system import System, small_architecture, started


@pytest.fixture
def bare_system(tmp_path: Path) -> Iterator[System]:
    """All components, but no manager yet."""
    with started(small_architecture(), tmp_path) as system:
        yield system


@pytest.fixture
def system(bare_system: System) -> System:
    """All components and a manager."""
    bare_system.start_manager()
    return bare_system


@pytest.fixture
def impatient(bare_system: System) -> System:
    """All components and a manager that does not wait long for one that hangs."""
    bare_system.start_manager(answer_within=0.4, bind_within=1.0, undo_within=0.6)
    return bare_system
