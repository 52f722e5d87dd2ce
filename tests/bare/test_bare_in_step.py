"""The bare component is a full member of simulated time."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.bus_schema.messages.protocol.control import ComponentView, ParameterValues
from regraft.bus_schema.messages.protocol.requests import Answer, Request, Verb
from regraft.bus_schema.messages.sensors import LightLevel
from tests.support.waiting import wait_for

from .kit_side import Asker, Mover, Recorder, Sun
from .systems import System
from .test_bare_component import Client

pytestmark = pytest.mark.slow

Runs = list[tuple[dict[str, Any], list[list[float]], ClockTime]]

MEMBERS = ("asker", "bare", "recorder")
DURATION = 2.0


def run_to_the_end() -> tuple[dict[str, Any], list[list[float]], ClockTime]:
    """Run the whole system for its duration; returns what was recorded, what was answered, and the last time told."""
    with System(simulated=True) as system:
        told: list[ClockTime] = []
        system.bus.subscribe(system.keys.clock("time"), lambda item: told.append(clock_time(system, item)))
        system.kit("recorder", Recorder)
        system.kit("asker", Asker)
        system.bare(connections={"light": "level"}, parameters={"gain": 0.5})
        system.kit("sun", Sun, members=MEMBERS, parameters={"speed": "max"}, duration=DURATION)
        wait_for(lambda: told and told[-1].finished, "the run ends")
        return system.state_of("recorder"), system.state_of("asker")["answers"], told[-1]


def clock_time(system: System, item: Any) -> ClockTime:
    sample = system.bus.open_sample(item)
    assert sample is not None
    return codec.decode(sample.payload, ClockTime)


@pytest.fixture(scope="module")
def runs() -> Runs:
    return [run_to_the_end() for _ in range(2)]


def test_every_tick_passes_through_it_in_no_simulated_time(runs: Runs) -> None:
    recorded, _, _ = runs[0]
    assert len(recorded["echoes"]) == round(DURATION * 20)
    assert all(stamp == came for stamp, _, came in recorded["echoes"])


def test_its_timer_follows_simulated_time(runs: Runs) -> None:
    times = [came for _, came in runs[0][0]["counts"]]
    assert len(times) >= round(DURATION * 10) - 1
    assert all(abs(later - earlier - 0.1) < 1e-6 for earlier, later in pairwise(times))


def test_a_call_to_it_takes_no_simulated_time(runs: Runs) -> None:
    answers = runs[0][1]
    assert len(answers) >= round(DURATION * 5) - 1
    assert all(asked == answered and darkness == 0.75 for asked, answered, darkness in answers)


def test_the_run_is_reproducible_with_it(runs: Runs) -> None:
    assert runs[0][:2] == runs[1][:2]
    assert all(last.reproducible and not last.dropped for _, _, last in runs)
    assert all("bare" in last.members for _, _, last in runs)


def test_its_input_moves_in_a_slot_and_every_tick_still_passes_through_it_once() -> None:
    with System(simulated=True) as system:
        told: list[ClockTime] = []
        system.bus.subscribe(system.keys.clock("time"), lambda item: told.append(clock_time(system, item)))
        system.kit("recorder", Recorder)
        system.kit("mover", Mover)
        system.bare(connections={"light": "level"})
        members = ("bare", "mover", "recorder")
        system.kit("sun", Sun, members=members, parameters={"speed": "max"}, duration=DURATION)
        wait_for(lambda: told and told[-1].finished, "the run ends")
        details = system.state_of("mover")["details"]
        echoes = system.state_of("recorder")["echoes"]
        assert (details[2], details[4]) == ({"missing": []}, {"complete": True})
        assert [came for _, _, came in echoes] == pytest.approx([0.05 * (1 + i) for i in range(40)])
        assert [stamp - came for stamp, _, came in echoes] == pytest.approx([0.0] * 20 + [1000.0] * 20)
        assert told[-1].reproducible


def test_requests_from_outside_reach_it_in_a_slot() -> None:
    with System(simulated=True) as system:
        system.bare(connections={"light": "level"})
        system.kit("sun", Sun, members=("bare",))
        system.wait_for("active", "bare", "sun")
        system.control("bare", "parameters", ParameterValues({"gain": 0.5}), ComponentView)
        reply = Client(system).put(Request("client-1", 1, Verb.CALL, codec.to_plain(LightLevel(1.0, 0.25))))
        assert (reply.answer, reply.body["darkness"]) == (Answer.RESULT, 0.75)
