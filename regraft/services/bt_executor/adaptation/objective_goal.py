"""An objective at a metacontroller, as a goal that is asked for again when it is lost."""

from __future__ import annotations

from typing import Final

from regraft import CallFailed, RefusalCode
from regraft.bus_schema.messages.management.objectives import (
    OBJECTIVE,
    REPORT,
    Objective,
    ObjectiveStatus,
    ProgressReport,
)
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.bus_schema.model.robots.planners import planner_service
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.services.bt_executor.adaptation.port_values.durations import AT_ONCE
from regraft.services.bt_executor.leaves.context import Asked, LeafContext

FOR_NOW: Final = frozenset(
    {
        RefusalCode.THROTTLED,
        RefusalCode.QUEUE_FULL,
        RefusalCode.BUSY,
        RefusalCode.STARTING,
        RefusalCode.NOT_ACTIVE,
        RefusalCode.UNAVAILABLE,
    }
)
"""Refusals of a metacontroller that may accept the same objective later."""
AFTER_ITS_END: Final = 5
"""How often an objective is asked for while another one of its name is still there: that one may be ending."""
MAX_UNKNOWN: Final = 3
"""How often in a row a goal may be unknown to its metacontroller before it counts as refused."""


class ObjectiveGoal:
    """Asks a metacontroller for an objective, and again under the same name whenever the goal is lost.

    Attributes:
        status: The latest status, None before the first.
        refusal: Why it is not asked for any more, empty while it is.
        problem: Why there is no answer now, empty if there is nothing wrong.
        again_at: When it is asked for again, None if it is under way; in seconds of the tree's clock.
        result: The status with which the objective has ended, None before.
    """

    def __init__(
        self, context: LeafContext, planner: str, objective: Objective, accept_within: float, retry_after: float
    ) -> None:
        """Ask nobody yet; ``planner`` is the full name of the metacontroller, the times are seconds."""
        self.objective = objective
        self.status: ObjectiveStatus | None = None
        self.result: ObjectiveStatus | None = None
        self.refusal = ""
        self.problem = ""
        self.again_at: float | None = None
        self._context = context
        self._planner = planner
        self._accept_within = accept_within
        self._retry_after = retry_after
        self._asked: Asked[ObjectiveStatus] | None = None
        self._is_ending = False
        self._unknown = 0
        self._conflicts = 0

    @property
    def name(self) -> str:
        """The name of the objective."""
        return self.objective.name or self.objective.skill

    @property
    def is_over(self) -> bool:
        """Whether the goal has ended and is not asked for again."""
        return self._asked is None and self.again_at is None

    def ask(self) -> None:
        """Give the goal."""
        self.again_at = None
        self._asked = self._context.goal(
            SHARED + planner_service(self._planner, OBJECTIVE),
            self.objective,
            ObjectiveStatus,
            ObjectiveStatus,
            accept_within=self._accept_within,
        )

    def look(self, now: float) -> None:
        """Take what has come, and ask again if it is time."""
        if self.again_at is not None and now >= self.again_at - AT_ONCE:
            self.ask()
        asked = self._asked
        if asked is None:
            return
        if asked.feedback is not None:
            self.status = asked.feedback
            self._unknown = self._conflicts = 0
            self.problem = ""
        if asked.done:
            self._asked = None
            if asked.error is not None:
                self._failed(asked.error, now)
            elif asked.answer is not None:
                self.result = self.status = asked.answer

    def report(self, text: str, timeout: float) -> Asked[ObjectiveStatus]:
        """Report a result of the skill; the goal is not asked for again from then on."""
        self._is_ending = True
        self.again_at = None
        service = SHARED + planner_service(self._planner, REPORT)
        return self._context.call(service, ProgressReport(self.name, text), ObjectiveStatus, timeout=timeout)

    def cancel(self) -> None:
        """Have the objective end; its end can be looked at later."""
        self._is_ending = True
        self.again_at = None
        if self._asked is not None:
            self._asked.give_up()

    def _failed(self, error: CallFailed, now: float) -> None:
        if self._is_ending:
            return
        if self._is_final(error):
            self.refusal = str(error)
            return
        self.problem = str(error)
        self.again_at = now + (self._retry_after if error.retry_after is None else error.retry_after)

    def _is_final(self, error: CallFailed) -> bool:
        """Return whether it is of no use to ask again.

        A metacontroller that ends or is deactivated cancels its goals; one that was started again does not know them.
        """
        if error.answer is not Answer.REFUSED or error.code in FOR_NOW:
            return False
        if error.code is RefusalCode.CONFLICT:
            self._conflicts += 1
            return self._conflicts >= AFTER_ITS_END
        if error.code is RefusalCode.NOT_FOUND and not error.field:
            self._unknown += 1
            return self._unknown >= MAX_UNKNOWN
        return True
