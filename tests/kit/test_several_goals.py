"""Actions that pursue several goals at once."""

from __future__ import annotations

from typing import Any

import pytest

from regraft import CallFailed, Component, RefusalCode, action
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.bus_schema.model.lifecycle import Transition
from regraft.client import ClientGoal
from regraft.component.component import describe
from regraft.runtime.core.clock import RealClock
from regraft.runtime.data.writers import Identity, Writers
from regraft.testing import Rig
from tests.kit.parts import Number, Walker
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

GOALS = 3


class Waiter(Component):
    """Serves several tables at once: a goal ends when its table is done."""

    def __init__(self) -> None:
        self.serving: dict[str, int] = {}
        self.done: set[int] = set()
        self.ended: list[int] = []

    @action("serve", feedback=Number, goals=GOALS)
    async def serve(self, table: Number) -> Number:
        """Serve a table until it is done."""
        self.serving[self.kit.goal_id] = table.value
        try:
            while table.value not in self.done:
                self.kit.feedback(table)
                await self.kit.sleep(0.01)
            return Number(table.value * 10)
        finally:
            self.ended.append(self.serving.pop(self.kit.goal_id))


def _goals(site: Site, *tables: int) -> list[ClientGoal[Number, Number]]:
    return [site.client.goal("serve", Number(table), Number, Number) for table in tables]


def _code(error: pytest.ExceptionInfo[CallFailed]) -> tuple[Answer | None, RefusalCode | None]:
    return error.value.answer, error.value.code


def test_each_goal_has_its_own_feedback_and_result(site: Site) -> None:
    waiter = site.start(Waiter, "waiter")
    goals = _goals(site, 1, 2, 3)
    wait_until(lambda: [goal.feedback for goal in goals] == [Number(1), Number(2), Number(3)])
    assert len(set(waiter.serving)) == GOALS
    for table in (2, 3, 1):
        waiter.done.add(table)
        assert goals[table - 1].result(PATIENCE) == Number(table * 10)
        assert goals[table - 1].result(PATIENCE) == Number(table * 10), "it can be asked for again"
    assert waiter.ended == [2, 3, 1]


def test_a_goal_too_many_is_refused_with_a_code_and_harms_no_other(site: Site) -> None:
    waiter = site.start(Waiter, "waiter")
    goals = _goals(site, 1, 2, 3)
    with pytest.raises(CallFailed, match="serve pursues 3 goals already") as refused:
        _goals(site, 4)[0].result(PATIENCE)
    assert _code(refused) == (Answer.REFUSED, RefusalCode.BUSY)
    wait_until(lambda: sorted(waiter.serving.values()) == [1, 2, 3], "all others to be begun")
    waiter.done.add(1)
    assert goals[0].result(PATIENCE) == Number(10)
    (again,) = _goals(site, 4)
    waiter.done |= {2, 3, 4}
    assert [goal.result(PATIENCE) for goal in (*goals[1:], again)] == [Number(20), Number(30), Number(40)]


def test_a_cancelled_goal_ends_alone_and_makes_room(site: Site) -> None:
    waiter = site.start(Waiter, "waiter")
    goals = _goals(site, 1, 2, 3)
    goals[1].cancel()
    with pytest.raises(CallFailed) as cancelled:
        goals[1].result(PATIENCE)
    assert cancelled.value.answer is Answer.CANCELLED
    assert waiter.ended == [2]
    _goals(site, 4)
    wait_until(lambda: sorted(waiter.serving.values()) == [1, 3, 4], "the goal to be begun")


def test_a_goal_that_raises_fails_alone(site: Site) -> None:
    waiter = site.start(Waiter, "waiter")
    first, second = _goals(site, 1, 2)
    runtime = site.runtimes["waiter"]

    def spoil() -> None:
        waiter.serving.clear()  # the goals that end now cannot be taken out
        waiter.done.add(1)

    wait_until(lambda: len(waiter.serving) == 2, "both to be begun")
    runtime.post(spoil)
    with pytest.raises(CallFailed, match="KeyError") as failed:
        first.result(PATIENCE)
    assert failed.value.answer is Answer.FAILED
    assert not second.done


def test_a_refused_goal_is_not_begun_when_it_is_asked_for_again(site: Site) -> None:
    waiter = site.start(Waiter, "waiter")
    goals = _goals(site, 1, 2, 3)
    bus, replies = site.session(), list[Reply]()

    def take(item: Any) -> None:
        sample = bus.open_sample(item)
        if sample and sample.payload:
            replies.append(codec.decode(sample.payload, Reply))

    bus.subscribe(site.keys.reply("serve", "stutterer"), take)
    writers = Writers(bus, RealClock(), Identity("stutterer", 1, 1))
    requests = writers.open(site.keys.request("serve"), type_of(Request).encoding)
    assert requests.wait_for_reader(PATIENCE)
    request = codec.encode(Request("stutterer", 1, Verb.GOAL, codec.to_plain(Number(4))))
    requests.put(request)
    wait_until(lambda: len(replies) == 1)
    waiter.done.add(1)
    goals[0].result(PATIENCE)
    requests.put(request)
    wait_until(lambda: len(replies) == 2)
    assert replies[0] == replies[1]
    assert (replies[0].answer, replies[0].code) == (Answer.REFUSED, RefusalCode.BUSY)
    assert 4 not in waiter.serving.values()


def test_deactivating_ends_every_goal(site: Site) -> None:
    waiter = site.start(Waiter, "waiter")
    goals = _goals(site, 1, 2, 3)
    runtime = site.runtimes["waiter"]
    runtime.post(lambda: runtime.lifecycle.perform(Transition.DEACTIVATE))
    for goal in goals:
        with pytest.raises(CallFailed, match="deactivated"):
            goal.result(PATIENCE)
    assert sorted(waiter.ended) == [1, 2, 3]


def test_several_goals_in_simulated_time_are_the_same_in_every_run() -> None:
    def run() -> list[tuple[float, list[int]]]:
        with Rig() as rig:
            waiter, found = rig.add(Waiter), []
            goals = [rig.goal("serve", Number(table), Number, Number) for table in (3, 1, 2, 4)]
            for table in (1, 2, 3):
                rig.advance(0.5)
                waiter.done.add(table)
                found.append((rig.clock.now() / 1e9, list(waiter.ended)))
            rig.advance(0.5)
            assert goals[3].error is not None
            assert goals[3].error.code is RefusalCode.BUSY
            assert [goal.result for goal in goals[:3]] == [Number(30), Number(10), Number(20)]
            return [*found, (rig.clock.now() / 1e9, list(waiter.ended))]

    assert run() == run()


def test_the_description_says_how_many(site: Site) -> None:
    (served,) = describe(Waiter).services
    (walked,) = describe(Walker).services
    assert (served.goals, walked.goals) == (GOALS, 1)


@pytest.mark.parametrize("goals", [0, -1, 257, 1.5, True, "3"])
def test_a_number_of_goals_that_cannot_be_is_refused(goals: Any) -> None:
    with pytest.raises(ValueError, match="must be a whole number from 1 to 256"):
        action("serve", goals=goals)


def test_outside_of_an_action_there_is_no_goal() -> None:
    class Idle(Component):
        """Pursues nothing."""

    with Rig() as rig:
        assert rig.add(Idle).kit.goal_id == ""
