"""Commands that a person has stopped, as by Ctrl-Z, while data flows to them."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterator

import pytest

from regraft.host.watchdog.memory_use import resident_size
from tests.hostile.components.test_bad_components import heard
from tests.hostile.conftest import HEAD, SINK, SOURCE, Start
from tests.support.machine.processes import stop
from tests.support.paths import ROOT
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

FLOOD = "  flood: {class: 'tests.hostile.parts:Flood', parameters: {size: 10000, seconds: 6000.0}}\n"
WORLD = "  world: {class: 'tests.stepped.parts:TinyWorld'}\n"
SIMULATED = """\
system: tests
clock: simulated
speed: max
seed: 1
imports: [tests.hostile.parts, tests.stepped.parts]
topics:
  numbers: {type: hostile_tests/Number, writers: many}
  position: {type: stepped_tests/Reading}
components:
"""
MORE_THAN_LINKS_HOLD = 20_000
"""Numbers of 10 kB."""
HELD_UP = ("clock.dropped", "message.lost")


@contextlib.contextmanager
def _stopped_commands(count: int) -> Iterator[None]:
    command = [sys.executable, "-m", "regraft.cli", "topic", "echo", "numbers"]
    with contextlib.ExitStack() as ended:
        echoes = [
            ended.enter_context(subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL))
            for _ in range(count)
        ]
        for echo in echoes:
            ended.callback(echo.kill)
        for echo in echoes:
            assert echo.stdout is not None
            assert echo.stdout.readline()
            stop(echo.pid)
        yield


@pytest.mark.parametrize("count", [1, 4])
@pytest.mark.parametrize("head", [HEAD, SIMULATED])
def test_commands_that_are_stopped_while_data_flows_hold_up_nobody(start: Start, head: str, count: int) -> None:
    system = start(FLOOD + SOURCE + SINK + (WORLD if head == SIMULATED else ""), head=head)
    system.wait_running("flood")
    with _stopped_commands(count):
        before = heard(system)
        wait_until(lambda: heard(system) > before + MORE_THAN_LINKS_HOLD, "the sink to hear more")
        assert not [event for event in system.events if event.kind in HELD_UP]
        assert resident_size(system.process.pid) < 950
        system.must_have_kept_all()
