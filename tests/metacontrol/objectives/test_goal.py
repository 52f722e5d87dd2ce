"""The goal by which a tree gives an objective: lost, asked for again, and over."""

from __future__ import annotations

from typing import Any, cast

from regraft import CallFailed
from regraft.bus_schema.messages.management.objectives import Objective
from regraft.services.bt_executor.adaptation.objective_goal import ObjectiveGoal


class Question:
    """A question that is answered by hand."""

    def __init__(self) -> None:
        self.done = False
        self.error: CallFailed | None = None
        self.answer = self.feedback = None


class Context:
    """Keeps what is asked."""

    def __init__(self) -> None:
        self.goals: list[Question] = []

    def goal(self, *_: Any, **__: Any) -> Question:
        self.goals.append(Question())
        return self.goals[-1]

    def call(self, *_: Any, **__: Any) -> Question:
        return Question()


def test_a_goal_that_was_lost_is_asked_for_again_unless_its_result_was_reported() -> None:
    for reported in (False, True):
        context = Context()
        goal = ObjectiveGoal(cast("Any", context), "metacontrol", Objective("to_navigate", "patrol"), 5.0, 1.0)
        goal.ask()
        context.goals[0].done, context.goals[0].error = True, CallFailed("patrol", None, "lost")
        goal.look(10.0)
        if reported:
            goal.report("SUCCESS", 5.0)
        goal.look(11.0)
        assert len(context.goals) == (1 if reported else 2)
        assert goal.is_over is reported
