"""Chances that are new each time, and the table of what held at the end."""

from __future__ import annotations

import os
import random
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from tests.adaptation.conftest import bare_system, system
from tests.attack.tally import Tally, table
from tests.host.conftest import site
from tests.hostile.conftest import stack, start, start_for_all

__all__ = ["bare_system", "site", "stack", "start", "start_for_all", "system"]

SEED = "REGRAFT_ATTACK_SEED"
"""The environment variable that makes chances the same as those of a run before."""
PROPERTY = "attacked"
ROWS: list[Any] = []


def pytest_configure(config: pytest.Config) -> None:
    """Choose the seed before the processes begin that run the tests."""
    os.environ.setdefault(SEED, str(random.SystemRandom().randrange(10**6)))


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Collect the rows of each test as it ends."""
    if report.when == "teardown":
        ROWS.extend(row for name, row in report.user_properties if name == PROPERTY)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what was tried, and what held."""
    if ROWS:
        terminalreporter.write_line(f"\nseed {os.environ[SEED]} ({SEED}), Python {sys.version.split()[0]}")
        for line in table(ROWS):
            terminalreporter.write_line(line)


@pytest.fixture
def seed(request: pytest.FixtureRequest) -> int:
    """Return a seed of this test's own."""
    return random.Random(f"{os.environ[SEED]} {request.node.nodeid}").randrange(10**9)


@pytest.fixture
def chance(seed: int) -> random.Random:
    """Return this test's chances."""
    return random.Random(seed)


@pytest.fixture
def tally(request: pytest.FixtureRequest) -> Iterator[Tally]:
    """Return what counts; in the end all must have held."""
    tally = Tally()
    yield tally
    request.node.user_properties.extend((PROPERTY, row) for row in tally.rows())
    assert not tally.failures, "\n".join(tally.failures)
