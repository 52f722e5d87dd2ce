"""Simulated time goes on whatever strangers say about it."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest

from regraft.bus_schema.messages.protocol.clock import (
    Ack,
    ClockTime,
    Join,
    MarkerAck,
    SlotRequest,
    Step,
    StepKind,
    Wiring,
)
from regraft.bus_schema.messages.protocol.host import ProcessState
from tests.hostile.bus.raw import Raw, stranger
from tests.hostile.conftest import Start
from tests.support.systems import System
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

HEAD = """\
system: tests
clock: simulated
imports: [tests.stepped.parts]
topics:
  position: {type: stepped_tests/Reading}
  push: {type: stepped_tests/Reading}
components:
  world: {class: 'tests.stepped.parts:TinyWorld', parameters: {speed: max}}
  pusher: {class: 'tests.stepped.parts:Pusher'}
  adviser: {class: 'tests.stepped.parts:Adviser'}
  witness: {class: 'tests.stepped.parts:Witness'}
"""
MEMBERS = ("adviser", "pusher", "witness", "world")
GHOSTS = ("ghost", "ghost.of-the-world")
SECOND = 1_000_000_000
FAR = 2**62


@pytest.fixture(scope="module")
def system(start_for_all: Start) -> System:
    system = start_for_all("", head=HEAD)
    wait_until(lambda: _time(system) > SECOND, "time")
    return system


@pytest.fixture
def raw(system: System) -> Iterator[Raw]:
    with stranger(system.info, lockstep=True) as raw:
        yield raw


def _told(system: System) -> ClockTime | None:
    return system.client.clock()


def _time(system: System) -> int:
    told = _told(system)
    return told.time if told else 0


def _goes_on(system: System, seconds: float = 2.0, patience: float = 30.0) -> None:
    """Wait until time has gone on, nobody was restarted, and all members are back."""
    before = _time(system)
    wait_until(lambda: _time(system) > before + seconds * SECOND, "time to go on", patience)
    told = _told(system)
    assert told is not None
    assert told.time < FAR / 2
    processes = system.processes()
    assert {name: (p.incarnation, p.state) for name, p in processes.items()} == dict.fromkeys(
        MEMBERS, (1, ProcessState.RUNNING)
    )
    wait_until(lambda: (t := _told(system)) is not None and t.members == MEMBERS, "all members", patience)


def _reproducible(system: System) -> bool:
    told = _told(system)
    return told is not None and told.reproducible and not told.dropped


@pytest.mark.parametrize("incarnation", [0, 1, 2, 2**32 - 1, 2**63 - 1])
def test_forged_acknowledgements_of_no_step_change_nothing(system: System, raw: Raw, incarnation: int) -> None:
    key = system.client.keys.clock("ack")
    for member in (*MEMBERS, *GHOSTS, "", "*"):
        for number in (0, 2**40, 2**63 - 1):
            raw.say(key, Ack(member, incarnation, number, {"tests/topic/push": FAR}, FAR, True, None, ("world",)))
    _goes_on(system)
    assert _reproducible(system)


def test_forged_joins_of_members_that_are_there_change_nothing(system: System, raw: Raw) -> None:
    wiring = Wiring({"tests/**": True}, {"tests/topic/push": FAR})
    for member in MEMBERS:
        for incarnation in (0, 1):
            raw.say(system.client.keys.clock("join"), Join(member, incarnation, 1, wiring, 0, FAR, True))
    _goes_on(system)
    assert _reproducible(system)


def test_a_forged_join_of_a_run_that_does_not_live_changes_nothing(system: System, raw: Raw) -> None:
    wiring = Wiring({"tests/**": True, "tests/topic/position": True}, {"tests/topic/push": 5})
    for member, incarnation in (("pusher", 2), ("pusher", 2**32 - 1), ("witness", 7), ("ghost", 1), ("*", 1), ("", 0)):
        raw.say(system.client.keys.clock("join"), Join(member, incarnation, 1, wiring, 0, FAR, True))
    _goes_on(system)
    assert _reproducible(system)


def test_forged_markers_and_wants_change_nothing(system: System, raw: Raw) -> None:
    keys = system.client.keys
    for member in (*MEMBERS, *GHOSTS):
        for incarnation in (0, 1, 2):
            raw.say(keys.clock("marker_ack"), MarkerAck(member, incarnation, keys.topic("push"), "pusher", FAR))
            outside = ("pusher", "", "*", "nobody", *(f"stranger-{n}" for n in range(1000)))
            raw.say(keys.clock("slot_request"), SlotRequest(member, incarnation, outside))
    _goes_on(system)
    assert _reproducible(system)


@pytest.mark.parametrize("incarnation", [0, 2, 2**32 - 1])
def test_forged_steps_of_another_run_change_nothing(system: System, raw: Raw, incarnation: int) -> None:
    for member in MEMBERS:
        for kind in StepKind:
            for number in (0, 1, FAR):
                step = Step(incarnation, number, kind, FAR, 0, FAR, {"tests/topic/push": {"pusher": FAR}})
                raw.say(system.client.keys.clock(f"step/{member}"), step)
    _goes_on(system)
    assert _reproducible(system)


def test_a_forged_time_is_corrected_by_the_next_one(system: System, raw: Raw) -> None:
    forged = ClockTime(FAR, FAR, 1.0, ("nobody",), finished=True)
    raw.say(system.client.keys.clock("time"), forged)
    wait_until(lambda: _time(system) == FAR)
    wait_until(lambda: _time(system) < FAR)
    _goes_on(system)
    assert _reproducible(system)


def test_forged_tokens_of_members_change_nothing(system: System, raw: Raw) -> None:
    for member, run in (("pusher", "2"), ("pusher", "x"), ("pusher", "1" * 5000), ("ghost", "1"), ("world", "7")):
        token = raw.token(f"tests/component/{member}/alive/{run}")
        token.undeclare()
    raw.token("tests/clock/alive/99").undeclare()
    _goes_on(system)
    assert _reproducible(system)


def test_a_storm_of_forged_clock_messages_is_survived(system: System, raw: Raw) -> None:
    dice = random.Random(7)
    for _ in range(3000):
        part = dice.choice(
            ("ack", "join", "marker_ack", "slot_request", "time", "step/pusher", "step/world", "step/ghost", "alive/1")
        )
        raw.put(system.client.keys.clock(part), dice.randbytes(dice.randint(0, 80)), "regraft/Ack@1", b"")
    _goes_on(system)
    assert _reproducible(system)


@pytest.mark.evidence
def test_a_step_forged_in_the_name_of_the_clock_is_recovered_from(system: System, raw: Raw) -> None:
    for kind in (StepKind.STEP, StepKind.WELCOME, StepKind.SLOT, StepKind.MARK):
        step = Step(1, FAR, kind, 1, 0, 1, {"tests/topic/position": {"world": FAR}})
        raw.say(system.client.keys.clock("step/pusher"), step)
    _goes_on(system, patience=90.0)
