"""What makes a run in step another one each time is told with its place."""

from __future__ import annotations

import re
from pathlib import Path

from tests.host.system import System
from tests.hostile import unrepeatable
from tests.hostile.conftest import Start
from tests.hostile.test_forged_clock import HEAD
from tests.waiting import wait_until

RESTLESS = "  restless: {class: 'tests.hostile.unrepeatable:Restless'}\n"
CALLS = ("numpy.random.rand", "random.choice", "random.random", "time.monotonic", "time.time", "uuid.uuid4")
EVENT = re.compile(r"component\.unrepeatable: (\S+):(\d+): (\S+) gives something else in each run: use ")


def _told(system: System) -> list[tuple[str, ...]]:
    """Return the events in the component's log: they may come before anybody listens."""
    return [found.groups() for line in system.client.logs("restless", 1000) if (found := EVENT.search(line))]


def _time(system: System) -> float:
    told = system.client.clock()
    return told.time / 1e9 if told else 0.0


def test_clocks_and_chance_that_are_not_the_kits_are_told_once_with_file_and_line(start: Start) -> None:
    system = start(RESTLESS, head=HEAD)
    wait_until(lambda: "restless" in system.processes() and len(_told(system)) >= len(CALLS), "all to be told")
    now = _time(system)
    wait_until(lambda: _time(system) > now + 5.0, "it to be read again")
    lines = Path(unrepeatable.__file__).read_text().splitlines()
    for file, line, call in _told(system):
        assert file == unrepeatable.__file__
        assert call.rpartition(".")[2] in lines[int(line) - 1]
    assert sorted(call for _, _, call in _told(system)) == list(CALLS)
