"""What holds for all tests."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Generator

import pytest
from hypothesis import HealthCheck, settings

from regraft.sim_service.cameras.renderers import RendererName
from tests.support.machine.renderers import best
from tests.support.machine.workers import give_back_memory, workers
from tests.support.waiting import slowness

# Let Python keep what it compiles, also where the environment says not to: hundreds of processes would do it again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# How long an example takes says more about the machine than about the code.
settings.register_profile("tests", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("tests")

MAX_TEST = 300.0
"""Seconds that a test may take, while every thread that wants to run does."""


def pytest_xdist_auto_num_workers() -> int:
    """Run the tests in as many processes as the machine allows."""
    return workers()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> None:
    """Give a test longer on a machine that is busy with other things."""
    marked = item.get_closest_marker("timeout")
    seconds = marked.args[0] if marked else MAX_TEST
    item.add_marker(pytest.mark.timeout(seconds * slowness()), append=False)


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Leave memory to the others after the last test of a file."""
    if nextitem is None or nextitem.path != item.path:
        give_back_memory()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Have no collection of garbage look through what is imported and collected: not now, and not later.

    It is some 400,000 objects, and to look at them all stops every thread of the process, for a second on a busy
    machine: longer than whoever is linked to it waits for a sign of life.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.collect()
        gc.freeze()


@pytest.fixture(params=["ray", "best"])
def renderer(request: pytest.FixtureRequest) -> RendererName:
    """Return the renderer that works everywhere, then the best one of this machine."""
    return "ray" if request.param == "ray" else best()
