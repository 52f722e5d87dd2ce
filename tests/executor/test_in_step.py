"""Missions under simulated time in step, with every component on a thread of its own."""

from __future__ import annotations

from regraft import Component, Input, Output, every
from regraft.bus_schema.messages.maps import Goals
from regraft.bus_schema.messages.mission import (
    BlackboardEntries,
    Command,
    MissionCommand,
    MissionStatus,
    MissionTransitions,
    WriteBlackboard,
)
from regraft.bus_schema.model.lifecycle import State
from regraft.services.bt_executor.executor import Executor
from tests.executor.helpers import FROG, tree
from tests.executor.robot import PLACES, Detector, Navigator, goals
from tests.stepped.parts import TinyWorld
from tests.support.stepped.step_site import StepSite


class GoalGiver(Component):
    """Says every two seconds where to go."""

    goals = Output(Goals)

    @every(seconds=2.0)
    def tell(self) -> None:
        """Say it."""
        self.goals.publish(goals(*PLACES))


class Witness(Component):
    """Keeps all that is said of the mission."""

    mission = Input(MissionStatus)

    def __init__(self) -> None:
        self.seen: list[MissionStatus] = []

    @mission.handler
    def take(self, status: MissionStatus) -> None:
        """Keep it."""
        self.seen.append(status)


def run_in_step() -> tuple[list[float], list[MissionStatus]]:
    """Run FROG's mission for 60 s of simulated time; returns the goals reached and what was said."""
    steps = StepSite("memory")
    try:
        steps.start(Navigator, "navigator", parameters={"failures": 1}, state=State.ACTIVE)
        steps.start(Detector, "detector", parameters={"failures": 1}, state=State.ACTIVE)
        steps.start(GoalGiver, "goal_giver", state=State.ACTIVE)
        steps.start(Witness, "witness", state=State.ACTIVE)
        steps.start(Executor, "bt_executor", parameters={"mission": str(FROG)}, state=State.ACTIVE)
        members = ("bt_executor", "detector", "goal_giver", "navigator", "witness")
        steps.start_world(TinyWorld, members, 60.0)
        assert steps.wait_finished().reproducible
        return steps.component("navigator").reached, steps.component("witness").seen
    finally:
        steps.close()


SWAPPED_IN = tree(
    '<Script code="seen := wanted"/>', '<WaitValueUpdate entry="wanted"><Sleep msec="700"/></WaitValueUpdate>'
)


class Operator(Component):
    """Has another tree take over at 2 s, and writes to its blackboard each 0.9 s; keeps what was answered."""

    changes = Input(MissionTransitions, topic="mission/transitions", required=False)

    def __init__(self) -> None:
        self.answers: list[object] = []
        self.changed: list[MissionTransitions] = []

    @changes.handler
    def follow(self, changes: MissionTransitions) -> None:
        """Keep it."""
        self.changed.append(changes)

    def on_activate(self) -> None:
        """Begin."""
        self.kit.spawn(self.operate(), "operating")

    async def operate(self) -> None:
        """Write, swap, write again."""
        for number in range(10):
            await self.kit.sleep(0.9)
            if number == 2:
                swap = MissionCommand(Command.SWAP, SWAPPED_IN)
                self.answers.append(await self.kit.call("mission/command", swap, MissionStatus))
            write = WriteBlackboard({"wanted": number})
            self.answers.append(await self.kit.call("mission/write", write, BlackboardEntries))


def operate_in_step() -> tuple[list[object], list[MissionTransitions]]:
    """Have a mission swapped and written to in simulated time; returns answers and changes of statuses."""
    steps = StepSite("memory")
    try:
        steps.start(Executor, "bt_executor", parameters={"mission": str(FROG)}, state=State.ACTIVE)
        steps.start(Operator, "operator", state=State.ACTIVE)
        steps.start_world(TinyWorld, ("bt_executor", "operator"), 12.0)
        assert steps.wait_finished().reproducible
        operator = steps.component("operator")
        return operator.answers, operator.changed
    finally:
        steps.close()


def test_swaps_and_writes_in_step_give_equal_runs() -> None:
    answers, changed = operate_in_step()
    assert len(answers) == 11
    assert len({changes.structure for changes in changed}) == 2
    assert (answers, changed) == operate_in_step()


def test_equal_runs_in_step_give_equal_traces() -> None:
    reached, seen = run_in_step()
    assert reached[:3] == [0.0, 1.0, 2.0]
    assert len(seen) > 15
    assert (reached, seen) == run_in_step()
