"""Components of the patrol are killed around switches of the realization.

It is never half in force, and the robot goes on, or stands with its reason.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.reading import read_skills
from regraft.bus_schema.model.adaptation import Outcome
from tests.patrol.witness import Seen, read
from tests.support.paths import PATROL
from tests.support.running import entered, ran, reports

pytestmark = [pytest.mark.evidence, pytest.mark.timeout(7200)]

VICTIMS = (
    "metacontrol",
    "adaptation_manager",
    "component_observer",
    "quality_observer",
    "amcl",
    "controller_server",
    "bt_navigator",
)
KILLS, SECONDS = 20, 170.0
FAILURES = tuple(20.0 + 40.0 * number for number in range(4))
"""When (s) the laser falls silent."""
SILENT = 15.0
"""s for which it is so."""
LEAST_WAY = 15.0
"""m that a patrol which continues has driven at least."""
LONG = 20.0
"""s for which a robot may stand without a reason: a person may be in its way."""
MOVED = 0.1
"""m beyond which a robot does not stand."""
SETTLED = 3.0
"""s after which a switch, and the return of what was killed, have to be over."""


def kill_times(victim: str) -> list[list[float]]:
    """Return when the victim is killed in each run: within half a second of when a switch is due."""
    random = Random(f"kills of {victim}")
    due = [at for begin in FAILURES for at in (begin + 0.5, begin + 17.5)]
    times: list[list[float]] = []
    while sum(map(len, times)) < KILLS:
        left = KILLS - sum(map(len, times))
        times.append([round(at + random.uniform(-0.25, 0.25), 2) for at in due[:left]])
    return times


def whole_sets() -> set[frozenset[str]]:
    """Return what is active in each realization, with what is so in rest, too."""
    found = {
        each.name: frozenset(part.name for part in each.components if part.is_active)
        for each in read_skills(PATROL / "patrol.skills").realizations
        if each.skill == "to_navigate"
    }
    return {active | found["default"] for active in found.values()}


def standing_without_reason(seen: list[Seen]) -> Iterator[float]:
    """Return the times (s) from which on the robot stands for long, and nobody gives a reason."""
    for first, begin in enumerate(seen):
        stretch = [each for each in seen[first:] if each.time <= begin.time + LONG]
        stands = all(math.dist(each.place, begin.place) < MOVED and not each.reasons for each in stretch)
        if stands and stretch[-1].time >= begin.time + LONG - 1.0:
            yield begin.time


def longest_use(seen: list[Seen]) -> float:
    """Return for how long (s) the laser was in use without a break: one that was off when it failed is tried."""
    longest, since = 0.0, math.inf
    for each in seen:
        since = min(since, each.time) if "laser_resender" in each.active else math.inf
        longest = max(longest, each.time - since)
    return longest


@pytest.mark.parametrize("victim", VICTIMS)
def test_a_kill_around_a_switch_leaves_a_whole_realization_or_none(tmp_path: Path, victim: str) -> None:
    wholes = whole_sets()
    parts = frozenset().union(*wholes)
    for number, times in enumerate(kill_times(victim)):
        home = tmp_path / str(number)
        home.mkdir()
        seen = run_and_watch(home, victim, times)
        assert Outcome.STUCK not in [each.outcome for each in reports(home)]
        disturbed = [*times, *(at for at, _ in entered(home))]
        for each in seen:
            if all(not at <= each.time <= at + SETTLED for at in disturbed):
                assert each.active & parts in wholes, (victim, number, each)
        assert list(standing_without_reason(seen)) == [], (victim, number)
        by_laser = [each.time for each in seen if "laser_resender" in each.active]
        for begin in FAILURES:
            silent = [each for each in seen if begin <= each.time <= begin + SILENT]
            assert longest_use(silent) <= 2.0 * SETTLED, (victim, number, begin)
        for begin, following in pairwise(FAILURES):
            assert [at for at in by_laser if begin + SILENT < at <= following], (victim, number, begin)


def run_and_watch(home: Path, victim: str, times: list[float]) -> list[Seen]:
    """Run the patrol with failures of the laser, kill a component at some times, and return what was seen."""
    seen = home / "seen.txt"
    faults = [{"at": at, "component": victim, "kind": "kill"} for at in times]
    stack = home / "patrol.yaml"
    stack.write_text(
        f"include: ['{PATROL / 'stack.yaml'}']\n"
        f"faults: {json.dumps(faults)}\n"
        "components:\n"
        f"  witness: {{class: 'tests.patrol.witness:Witness', parameters: {{file: '{seen}'}}}}\n"
        "  component_observer: {parameters: {presumed_after: 16.0}}\n"
    )
    failures = [
        {"at": at, "device": "lidar", "failure": failure}
        for begin in FAILURES
        for at, failure in ((begin, "silent"), (begin + SILENT, "none"))
    ]
    summary = ran(stack, home, SECONDS, f"world.failures={json.dumps(failures)}", "gateway.port=0")
    print(f"{victim}, killed at {times}: {summary['distance']:.1f} m")
    assert summary["distance"] > LEAST_WAY
    return read(seen)
