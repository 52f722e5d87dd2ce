"""Components of the patrol are killed around switches of the realization: it is never half in force."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random

import pytest

from regraft.adaptation_manager.planners.metacontrol.skills.reading import read_skills
from regraft.bus_schema.model.adaptation import Outcome
from tests.patrol.witness import read
from tests.support.paths import PATROL
from tests.support.running import entered, modes, ran, reports

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
"""When (s) the laser falls silent; for 15 s each."""
LEAST_WAY = 15.0
"""m that a patrol which continues has driven at least."""
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


@pytest.mark.parametrize("victim", VICTIMS)
def test_a_kill_around_a_switch_leaves_a_whole_realization_or_none(tmp_path: Path, victim: str) -> None:
    wholes = whole_sets()
    parts = frozenset().union(*wholes)
    for number, times in enumerate(kill_times(victim)):
        home = tmp_path / str(number)
        home.mkdir()
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
            for at, failure in ((begin, "silent"), (begin + 15.0, "none"))
        ]
        summary = ran(stack, home, SECONDS, f"world.failures={json.dumps(failures)}", "gateway.port=0")
        assert Outcome.STUCK not in [each.outcome for each in reports(home)]
        assert modes(home).count("to_navigate.degraded") >= len(FAILURES)
        assert summary["distance"] > LEAST_WAY
        disturbed = [*times, *(at for at, _ in entered(home))]
        for time, active in read(seen):
            if all(not at <= time <= at + SETTLED for at in disturbed):
                assert active & parts in wholes, (victim, number, time, sorted(active))
