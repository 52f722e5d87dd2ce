"""A task that is cancelled ends, whatever its clean-ups do, and whoever cancels it."""

from __future__ import annotations

import pytest

from regraft import Cancelled, Component, action, every
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.testing import Rig
from tests.kit.parts import Number


class Tidy(Component):
    """Pursues goals whose clean-ups await, in several ways."""

    def __init__(self) -> None:
        self.steps: list[str] = []

    @action("nested")
    async def nested(self, goal: Number) -> Number:
        try:
            try:
                await self.kit.sleep(100.0)
            finally:
                self.steps.append("inner")
                await self.kit.sleep(1.0)
        finally:
            self.steps.append("outer")
            await self.kit.sleep(1.0)
        return goal

    @action("raising")
    async def raising(self, goal: Number) -> Number:
        try:
            try:
                await self.kit.sleep(100.0)
            finally:
                await self.kit.sleep(1.0)
        finally:
            raise KeyError("gone")

    @action("endless")
    async def endless(self, goal: Number) -> Number:
        while True:
            try:
                await self.kit.sleep(100.0)
            except Cancelled:
                self.steps.append("cancelled")

    @action("plain")
    async def plain(self, goal: Number) -> Number:
        await self.kit.sleep(100.0)
        return goal


class Alone(Component):
    """Has a task that cancels itself."""

    def on_activate(self) -> None:
        self.steps: list[str] = []
        self.task = self.kit.spawn(self.work())

    async def work(self) -> None:
        await self.kit.sleep(1.0)
        try:
            self.task.cancel()
            self.task.cancel()
            self.steps.append("continues")
            assert not self.task.finished
            await self.kit.sleep(1.0)
            self.steps.append("never")
        finally:
            self.steps.append("cleaned up")


@pytest.mark.parametrize("which", ["nested", "raising", "endless"])
def test_a_goal_with_awaiting_clean_ups_that_is_cancelled_ends(which: str) -> None:
    with Rig() as rig:
        rig.add(Tidy)
        goal = rig.goal(which, Number(1), Number, Number)
        rig.advance(1.0)
        goal.cancel()
        rig.advance(0.1)
        assert goal.error is not None
        assert goal.error.answer is Answer.FAILED
        (fault,) = rig.take_faults()
        assert "awaited while it was being cancelled" in fault


def test_every_clean_up_is_begun_once() -> None:
    with Rig() as rig:
        tidy = rig.add(Tidy)
        rig.goal("nested", Number(1), Number, Number).cancel()
        rig.advance(10.0)
        assert tidy.steps == ["inner", "outer"]
        rig.take_faults()


def test_a_deactivation_ends_every_goal_also_behind_one_whose_clean_ups_await() -> None:
    with Rig() as rig:
        rig.add(Tidy)
        goals = [rig.goal(which, Number(1), Number, Number) for which in ("plain", "nested")]
        rig.transition("tidy", Transition.DEACTIVATE)
        assert [goal.done for goal in goals] == [True, True]
        assert rig.state("tidy") is State.INACTIVE
        rig.take_faults()


def test_a_task_that_cancels_itself_ends_where_it_awaits_next() -> None:
    with Rig() as rig:
        alone = rig.add(Alone)
        rig.advance(5.0)
        assert alone.task.finished
        assert alone.steps == ["continues", "cleaned up"]


class Pair(Component):
    """Has two tasks, each of which cancels the other as it is cancelled."""

    def on_activate(self) -> None:
        self.first = self.kit.spawn(self.first_task())
        self.second = self.kit.spawn(self.second_task())

    async def first_task(self) -> None:
        await self.kit.sleep(1.0)
        self.second.cancel()
        await self.kit.sleep(100.0)

    async def second_task(self) -> None:
        try:
            await self.kit.sleep(100.0)
        finally:
            self.first.cancel()

    @every(seconds=1.0)
    def look(self) -> None:
        self.looked_at = self.kit.now()


def test_tasks_that_cancel_each_other_end_both() -> None:
    with Rig() as rig:
        pair = rig.add(Pair)
        rig.advance(3.0)
        assert (pair.first.finished, pair.second.finished) == (True, True)
        assert pair.looked_at == 3.0
