"""What makes a run in step another one each time is told with its place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from regraft.process.unrepeatable import package_of
from tests.hostile.bus.test_forged_clock import HEAD
from tests.hostile.components import unrepeatable
from tests.hostile.conftest import Start
from tests.support.systems import System
from tests.support.waiting import wait_until

RESTLESS = "  restless: {class: 'tests.hostile.components.unrepeatable:Restless'}\n"
CALLS = ("numpy.random.rand", "random.choice", "random.random", "time.monotonic", "time.time", "uuid.uuid4")
TEXT = re.compile(r"(\S+):(\d+): (\S+) gives something else in each run: use ")


def _told(system: System) -> list[tuple[str, ...]]:
    texts = system.logged("component.unrepeatable", "restless")
    return [found.groups() for text in texts if (found := TEXT.match(text))]


def _time(system: System) -> float:
    told = system.client.clock()
    return told.time / 1e9 if told else 0.0


@pytest.mark.parametrize(
    ("module", "package"),
    [
        ("regraft.services.battery", "regraft.services"),
        ("regraft", "regraft"),
        ("regraft_acme.parts", "regraft_acme"),
        ("acme.robots.arm", "acme"),
    ],
)
def test_the_rooms_of_regraft_are_packages_of_their_own_and_a_like_name_is_somebody_elses(
    module: str, package: str
) -> None:
    assert package_of(module) == package


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
