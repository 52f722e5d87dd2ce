"""When each variant adapts, and what becomes of its child's result."""

from __future__ import annotations

import pytest

from regraft.bus_schema.model.adaptation import Outcome
from tests.adapting.helpers import Bench, FakeContext, bench, speed_change

SLOWER = 'subject_location="navigator" rules="max_velocity := speed" outcome="{o}" reason="{r}"'
EVERY_3_S = f'{SLOWER} adaptation_period="3s"'


def made(node_type: str, child: str, ports: str = SLOWER, *, answers: bool = True) -> Bench:
    return bench(node_type, ports, child, context=FakeContext(answers=answers), speed=0.1)


RUNNING, SUCCESS, FAILURE, SKIPPED = "RUNNING", "SUCCESS", "FAILURE", "SKIPPED"


@pytest.mark.parametrize(
    ("node_type", "child", "adaptations"),
    [
        ("AdaptOnStart", "RUNNING SUCCESS", 1),
        ("AdaptOnStart", "FAILURE", 1),
        ("AdaptOnRunning", "RUNNING SUCCESS", 1),
        ("AdaptOnRunning", "SUCCESS", 0),
        ("AdaptOnSuccess", "RUNNING SUCCESS", 1),
        ("AdaptOnSuccess", "RUNNING FAILURE", 0),
        ("AdaptOnFailure", "RUNNING FAILURE", 1),
        ("AdaptOnFailure", "RUNNING SUCCESS", 0),
        ("AdaptOnAnyStatus", "RUNNING SUCCESS", 1),
        ("AdaptOnAnyStatus", "RUNNING FAILURE", 1),
        ("AdaptPeriodically", "RUNNING RUNNING SUCCESS", 0),
    ],
)
def test_the_childs_own_result_is_returned_twice_in_a_row(node_type: str, child: str, adaptations: int) -> None:
    ports = EVERY_3_S if node_type == "AdaptPeriodically" else SLOWER
    at = made(node_type, child, ports)
    statuses = child.split()
    for round_ in (1, 2):
        assert at.ticks(len(statuses)) == statuses
        assert len(at.context.adaptations) == adaptations * round_
        assert (at.child.starts, at.child.ticks) == (round_, len(statuses) * round_)
        assert at.idle
        at.set(speed=0.2)


@pytest.mark.parametrize(
    ("node_type", "child", "while_asked", "child_ticks", "after"),
    [
        # What it returns until it is answered, how often the child has been ticked by then, what it returns then.
        ("AdaptOnStart", "SUCCESS", [RUNNING] * 3, 0, [SUCCESS]),
        ("AdaptOnStart", "RUNNING FAILURE", [RUNNING] * 3, 0, [RUNNING, FAILURE]),
        ("AdaptOnStart", "SKIPPED", [RUNNING] * 3, 0, [SKIPPED]),
        ("AdaptOnRunning", "RUNNING", [RUNNING] * 3, 3, [RUNNING]),
        ("AdaptOnRunning", "RUNNING SUCCESS", [RUNNING] * 3, 2, [SUCCESS]),
        ("AdaptOnRunning", "RUNNING RUNNING FAILURE", [RUNNING] * 3, 3, [FAILURE]),
        ("AdaptOnRunning", "RUNNING SKIPPED", [RUNNING] * 3, 2, [SKIPPED]),
        ("AdaptOnSuccess", "SUCCESS", [RUNNING] * 3, 1, [SUCCESS]),
        ("AdaptOnSuccess", "RUNNING SUCCESS", [RUNNING] * 3, 2, [SUCCESS]),
        ("AdaptOnFailure", "FAILURE", [RUNNING] * 3, 1, [FAILURE]),
        ("AdaptOnAnyStatus", "RUNNING FAILURE", [RUNNING] * 3, 2, [FAILURE]),
    ],
)
def test_an_answer_is_waited_for_without_losing_or_repeating_the_child(
    node_type: str, child: str, while_asked: list[str], child_ticks: int, after: list[str]
) -> None:
    at = made(node_type, child, answers=False)
    for speed in (0.1, 0.2):
        at.set(speed=speed)
        before = at.child.ticks
        at.context.answers = False
        assert at.ticks(3) == while_asked
        assert at.child.ticks - before == child_ticks
        at.context.answers = True
        at.context.answer()
        assert at.ticks(len(after)) == after
        assert at.context.asked_for[-1] == {"max_velocity": speed}
        assert at.entry("o") == "applied"
        at.tree.halt_tree()


@pytest.mark.parametrize("node_type", ["AdaptOnStart", "AdaptOnRunning", "AdaptOnSuccess", "AdaptOnAnyStatus"])
@pytest.mark.parametrize("answered_first", [False, True], ids=["reading the architecture", "adapting"])
def test_silence_is_waited_for_only_so_long(node_type: str, answered_first: bool) -> None:
    child = "RUNNING" if node_type == "AdaptOnRunning" else "SUCCESS"
    at = made(node_type, child, f'{SLOWER} timeout="2s" retry_after="1min"', answers=False)
    at.tick()
    if answered_first:
        at.context.answer()
        at.tick()
        assert len(at.context.adaptations) == 1
    assert at.ticks(2, 0.9) == [RUNNING] * 2
    at.tick(0.3)
    assert at.entry("o") == "no_answer"
    assert "no answer" in at.entry("r")
    assert not at.node.under_way.busy


@pytest.mark.parametrize(
    ("node_type", "child", "ticks"),
    [
        ("AdaptOnStart", "RUNNING", 1),
        ("AdaptOnStart", "RUNNING", 2),
        ("AdaptOnRunning", "RUNNING", 1),
        ("AdaptOnRunning", "RUNNING SUCCESS", 3),
        ("AdaptOnSuccess", "RUNNING SUCCESS", 1),
        ("AdaptOnSuccess", "RUNNING SUCCESS", 2),
        ("AdaptOnFailure", "FAILURE", 1),
        ("AdaptOnAnyStatus", "FAILURE", 2),
        ("AdaptPeriodically", "RUNNING", 1),
        ("AdaptPeriodically", "RUNNING", 40),
    ],
)
@pytest.mark.parametrize("late", [False, True], ids=["never answered", "answered after the halt"])
def test_a_halt_in_any_phase_leaves_nothing_behind(node_type: str, child: str, ticks: int, late: bool) -> None:
    ports = EVERY_3_S if node_type == "AdaptPeriodically" else SLOWER
    at = made(node_type, child, ports, answers=False)
    at.ticks(ticks)
    at.context.answer()
    at.tick()
    at.tree.halt_tree()
    assert at.idle
    assert at.child.halts == (1 if at.child.starts and child.split()[-1] == "RUNNING" else at.child.halts)
    wakes = at.context.wakes
    if late:
        at.context.answers = True
        at.context.answer()
    assert at.context.wakes == wakes, "an answer that nobody waits for must not wake the tree"
    assert at.entry("o") in (None, "")
    starts = at.child.starts
    at.context.answers = True
    at.set(speed=0.15)
    assert at.ticks(len(child.split())) == child.split()
    assert at.child.starts == starts + 1
    assert at.entry("o") != "no_answer"


def test_a_periodic_one_adapts_at_its_times_only() -> None:
    at = bench("AdaptPeriodically", EVERY_3_S.replace(":= speed", "-= 0.01"))
    times: list[float] = []
    for tick in range(1, 101):
        at.tick(0.1)
        if len(at.context.adaptations) > len(times):
            times.append(round(tick * 0.1, 1))
    assert times == [3.1, 6.1, 9.1], "the child started with the first tick, at 0.1 s"


def test_a_periodic_one_asks_the_tree_to_be_ticked_in_time() -> None:
    at = made("AdaptPeriodically", "RUNNING", EVERY_3_S)
    at.tick(0.25)
    assert at.tree.next_wake_up() == pytest.approx(3.25)
    at.tick(1.0)
    assert at.tree.next_wake_up() == pytest.approx(3.25)
    at.tick(2.0)
    assert len(at.context.adaptations) == 1
    assert at.tree.next_wake_up() == pytest.approx(6.25)


def test_the_tree_may_change_the_period() -> None:
    at = bench("AdaptPeriodically", EVERY_3_S.replace("3s", "{period}").replace(":= speed", "-= 0.01"), period="200ms")
    at.ticks(5)
    assert len(at.context.adaptations) == 2
    at.set(period="2min")
    at.ticks(100)
    assert len(at.context.adaptations) == 2
    at.set(period="1")
    at.ticks(11)
    assert len(at.context.adaptations) == 4, "at once, as the interval is long over, and after another second"


def test_a_time_that_comes_while_an_answer_is_outstanding_is_made_up_for_once() -> None:
    at = bench("AdaptPeriodically", f'{EVERY_3_S.replace(":= speed", "-= 0.01")} timeout="30s"')
    at.context.answers = False
    at.ticks(100, 0.1)
    assert len(at.context.asked) == 1
    at.context.answers = True
    at.context.answer()
    at.ticks(3, 0.1)
    assert len(at.context.adaptations) == 2


def test_a_running_one_adapts_until_there_is_nothing_more_to_adapt() -> None:
    at = bench("AdaptOnRunning", EVERY_3_S.replace(' adaptation_period="3s"', "").replace(":= speed", "-= 0.08"))
    at.node.setup.readers["rules"] = lambda: "max_velocity -= 0.08 within [0.1, 0.26]"
    at.ticks(50)
    assert at.context.asked_for == [{"max_velocity": 0.18}, {"max_velocity": 0.1}]
    # At its bound it looks no more than once a second whether somebody else has changed what it wants changed.
    assert len(at.context.asked) <= 2 + 2 + 6
    at.context.change(speed_change(0.26))
    at.ticks(25)
    assert at.context.asked_for[2:] == [{"max_velocity": 0.18}, {"max_velocity": 0.1}]


def test_a_decision_is_made_anew_if_somebody_else_was_faster() -> None:
    at = bench("AdaptOnStart", EVERY_3_S.replace(' adaptation_period="3s"', "").replace(":= speed", "-= 0.08"))
    at.context.answers = False
    at.tick()
    at.context.answer()
    at.tick()
    at.context.change(speed_change(0.2))
    at.context.answers = True
    at.context.answer()
    at.tick()
    assert at.context.asked_for == [{"max_velocity": 0.18}, {"max_velocity": 0.12}]
    assert at.entry("o") == "applied"


@pytest.mark.parametrize(
    ("fate", "port"),
    [
        (Outcome.REJECTED, "on_rejected"),
        (Outcome.ROLLED_BACK, "on_rolled_back"),
        (Outcome.CANCELLED, "on_rolled_back"),
        (Outcome.STUCK, "on_stuck"),
    ],
)
@pytest.mark.parametrize(
    ("node_type", "child", "ignored"),
    [
        ("AdaptOnStart", "SUCCESS", SUCCESS),
        ("AdaptOnRunning", "RUNNING", RUNNING),
        ("AdaptOnSuccess", "SUCCESS", SUCCESS),
        ("AdaptOnFailure", "FAILURE", FAILURE),
    ],
)
def test_what_follows_when_it_came_to_nothing_is_up_to_the_author(
    node_type: str, child: str, ignored: str, fate: Outcome, port: str
) -> None:
    at = bench(node_type, f'{SLOWER} {port}="fail"', child, context=FakeContext(fates=[fate]), speed=0.1)
    assert at.tick() == FAILURE
    assert at.entry("o") == fate.value
    assert at.entry("r")
    assert at.idle
    assert at.child.halts == (child == "RUNNING")

    at = bench(node_type, SLOWER, child, context=FakeContext(fates=[fate]), speed=0.1)
    assert at.tick() == ignored
    assert len(at.context.adaptations) == 1

    at = bench(
        node_type, f'{SLOWER} {port}="retry 2 then fail"', child, context=FakeContext(fates=[fate] * 3), speed=0.1
    )
    assert at.end() == [RUNNING] * 20 + [FAILURE]
    assert len(at.context.adaptations) == 3, "at 0.1 s, and 1 s and 2 s later"

    at = bench(node_type, f'{SLOWER} {port}="retry"', child, context=FakeContext(fates=[fate]), speed=0.1)
    at.ticks(11)
    assert at.entry("o") == "applied"
    assert at.entry("r") == ""


def test_a_retry_is_decided_anew() -> None:
    at = bench(
        "AdaptOnStart",
        f'{SLOWER} on_rejected="retry"',
        "SUCCESS",
        context=FakeContext(fates=[Outcome.REJECTED]),
        speed=0.1,
    )
    at.tick()
    at.set(speed=0.26)
    assert at.tick(1.0) == SUCCESS
    assert len(at.context.adaptations) == 1
    assert at.entry("o") == "unchanged"


def test_a_running_one_that_is_rejected_pauses() -> None:
    at = bench("AdaptOnRunning", SLOWER, context=FakeContext(fates=[Outcome.REJECTED] * 100), speed=0.1)
    at.ticks(40)
    assert len(at.context.adaptations) == 4


def test_a_step_from_something_that_is_not_there_is_told_and_does_no_harm() -> None:
    at = bench("AdaptOnStart", 'rules="navigator.max_speed -= 1" outcome="{o}" reason="{r}"', "SUCCESS")
    assert at.tick() == SUCCESS
    assert (at.entry("o"), at.entry("r")) == (
        "rejected",
        "navigator has no parameter 'max_speed'; it has: max_velocity, mode",
    )


def test_a_value_that_cannot_travel_is_told_and_does_no_harm() -> None:
    at = bench("AdaptOnStart", 'rules="navigator.max_velocity := 0 / 0" outcome="{o}" reason="{r}"', "SUCCESS")
    assert at.tick() == SUCCESS
    assert at.entry("o") == "rejected"
    assert at.context.asked_for == []
