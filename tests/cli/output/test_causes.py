"""Each cause of a run that does not count is named once, by a code: the host's account of an end, else the clock's."""

from __future__ import annotations

from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.protocol.clock import CauseCode, RunCause
from regraft.cli.system.causes import CauseLog


def log(*events: tuple[str, str], scheduled: bool = False) -> CauseLog:
    found = CauseLog()
    for number, (kind, component) in enumerate(events):
        found.take(Event(float(number), kind, component, "why", {"scheduled": scheduled}))
    return found


def named(causes: tuple[RunCause, ...]) -> list[tuple[str, str]]:
    return [(cause.code.value, cause.component) for cause in causes]


LEFT = RunCause(CauseCode.LEFT, "camera", 3.0)


def test_a_hung_component_is_named_once_as_hung_although_it_left_the_clock_and_was_restarted() -> None:
    found = log(("component.hung", "camera"), ("component.restarted", "camera")).with_clock([LEFT])
    assert named(found) == [("hung", "camera")]


def test_what_hosts_do_not_know_of_is_named_as_the_clock_does() -> None:
    lost = RunCause(CauseCode.MESSAGES_LOST, "mapper", 1.0)
    assert named(log().with_clock([LEFT, lost])) == [("messages_lost", "mapper"), ("left", "camera")]


def test_an_end_on_a_schedule_is_no_cause() -> None:
    assert log(("component.hung", "camera"), ("component.restarted", "camera"), scheduled=True).with_clock([]) == ()


def test_an_end_without_restart_is_a_cause_only_where_time_missed_the_component() -> None:
    ended = ("component.ended", "camera")
    assert log(ended).with_clock([]) == ()
    assert named(log(ended).with_clock([LEFT])) == [("ended", "camera")]


def test_a_crash_of_a_component_outside_of_simulated_time_is_a_cause() -> None:
    assert named(log(("component.restarted", "gateway")).with_clock([])) == [("ended", "gateway")]
