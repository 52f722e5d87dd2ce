"""Components whose authors made mistakes, in systems that have to go on."""

from __future__ import annotations

import pytest

from regraft import CallFailed
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.host.watchdog.memory_use import resident_size
from tests.hostile.conftest import SINK, SOURCE, Start
from tests.hostile.parts import Word
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

MAX_MEMORY = 950.0
"""MiB."""
LITTLE = "restart: {limit: 1, backoff: 0.01}"


def heard(system: System, patience: float = PATIENCE) -> int:
    """Return how many numbers the sink has heard."""
    return system.client.call("heard", Word(""), Word, patience).count


def test_components_that_are_deaf_to_the_request_to_end_or_cling_to_their_activity_are_ended(start: Start) -> None:
    clinging = "  clinging: {class: 'tests.hostile.parts:Clinging'}\n"
    system = start("  deaf: {class: 'tests.hostile.parts:Deaf'}\n" + clinging + SOURCE)
    for name in ("deaf", "clinging"):
        system.wait_running(name)
    assert system.end() == 0


def test_a_flood_is_survived_by_those_who_hear_it_and_those_beside_it(start: Start) -> None:
    flood = "  flood: {class: 'tests.hostile.parts:Flood'}\n"
    system = start(flood + SOURCE + SINK.replace("}", ", parameters: {delay: 0.0003}}"))
    sink = system.wait_running("sink")
    wait_until(lambda: any("flood" in lost.text for lost in system.said("message.lost", "sink")))
    assert all(lost.details["count"] > 0 for lost in system.said("message.lost", "sink"))
    most = 0.0

    def calm() -> bool:
        nonlocal most
        most = max(most, resident_size(sink.pid))
        seen = system.client.components()["source"]
        assert seen.age is not None
        assert seen.age < PATIENCE
        try:
            return heard(system, 0.5) > 0
        except CallFailed:
            return False

    wait_until(calm, "the sink to answer again")
    assert most < MAX_MEMORY
    system.must_have_kept_all()


@pytest.fixture(scope="module")
def faulty(start_for_all: Start) -> System:
    """Return a system in which one component cannot be made, and another fails at each number."""
    unborn = f"  unborn: {{class: 'tests.hostile.parts:Unborn', {LITTLE}}}\n"
    return start_for_all(unborn + "  clumsy: {class: 'tests.hostile.parts:Clumsy'}\n" + SOURCE + SINK)


@pytest.fixture(scope="module")
def silent(start_for_all: Start) -> System:
    """Return a system whose sink hears nothing, since nobody publishes what may be published."""
    nan = "  nan: {class: 'tests.hostile.parts:Nan'}\n"
    return start_for_all(nan + "  sneaky: {class: 'tests.hostile.parts:Sneaky', services: {failure: failure}}\n" + SINK)


def test_a_component_that_cannot_be_made_is_quarantined_and_its_log_says_why(faulty: System) -> None:
    system = faulty
    system.wait_for("unborn", lambda p: p.state is ProcessState.QUARANTINED, "quarantined")
    assert any("cannot be made" in line for line in system.client.logs("unborn"))
    system.wait_running("source")


def test_a_handler_that_always_fails_is_said_once_and_harms_nobody(faulty: System) -> None:
    system = faulty
    wait_until(lambda: heard(system) > 20)
    wait_until(lambda: system.logged("component.fault", "clumsy"))
    (told,) = system.logged("component.fault", "clumsy")
    assert "I drop everything" in told
    assert system.processes()["clumsy"].incarnation == 1


def test_a_number_that_is_none_is_never_sent_and_the_author_is_told(silent: System) -> None:
    system = silent
    system.wait_running("nan")
    wait_until(lambda: system.logged("component.fault", "nan"))
    assert "value" in system.logged("component.fault", "nan")[0]
    assert heard(system) == 0


def test_publishing_from_a_thread_is_refused_where_it_happens(silent: System) -> None:
    system = silent
    system.wait_running("sneaky")
    wait_until(lambda: "own thread" in system.client.call("failure", Word(""), Word).text)
    assert heard(system) == 0
