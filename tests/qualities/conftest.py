"""Two systems of gauges: one under the real clock, one under simulated time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.systems import System, all_ended, home

REAL = """\
system: tests
clock: real
components:
  gauge: {class: tests.qualities.parts:Gauge}
  broken: {class: tests.qualities.parts:Gauge, parameters: {mood: raises}}
  asleep: {class: tests.qualities.parts:Gauge, state: inactive}
  busy: {class: tests.qualities.parts:Busy}
  plain: {class: tests.qualities.parts:Plain}
  listener: {class: tests.qualities.parts:Listener}
"""
SIMULATED = """\
system: tests
clock: simulated
speed: real
topics: {world_state: regraft/WorldState}
components:
  world: {class: 'regraft.sim_service.world:World', parameters: {file: world.xml}}
  gauge: {class: tests.qualities.parts:Gauge}
"""
WORLD = '<mujoco><worldbody><geom type="plane" size="5 5 .1"/></worldbody></mujoco>'


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Run the gauges under the real clock for all tests of a module."""
    folder = tmp_path_factory.mktemp("gauges")
    (folder / "stack.yaml").write_text(REAL)
    with home(folder / "home"):
        made = System(folder / "stack.yaml")
        yield made
        made.end()


@pytest.fixture
def simulated(tmp_path: Path) -> Iterator[System]:
    """Run a gauge under simulated time, in whose stamps no process is late."""
    (tmp_path / "world.xml").write_text(WORLD)
    (tmp_path / "stack.yaml").write_text(SIMULATED)
    with home(tmp_path / "home"), all_ended() as started:
        started.append(System(tmp_path / "stack.yaml"))
        started[0].wait_running("gauge")
        yield started[0]
