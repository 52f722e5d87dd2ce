"""The decorator that has a metacontroller provide a skill while its child is at work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from behavior_tree import FAILURE, RUNNING, SKIPPED, SUCCESS, Decorator, Input, Node, NodeSetup, Output, Status
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.management.objectives import (
    CurvePoint,
    Objective,
    ObjectiveState,
    ObjectiveStatus,
    Progress,
)
from regraft.bus_schema.model.qualities.bounds import Bound, read_bounds
from regraft.bus_schema.model.qualities.curves import read_curve
from regraft.bus_schema.suggestions import instead_of
from regraft.services.bt_executor.adaptation.objective_goal import ObjectiveGoal
from regraft.services.bt_executor.adaptation.port_values.durations import AT_ONCE
from regraft.services.bt_executor.adaptation.port_values.ports import PLANNER, duration_of, is_known, json_of
from regraft.services.bt_executor.adaptation.port_values.terms import BAD_VALUES
from regraft.services.bt_executor.leaves.asking_leaf import require_ports, write_if_connected
from regraft.services.bt_executor.leaves.context import Asked, LeafContext
from regraft.services.bt_executor.leaves.plain_messages import filled

WAIT, FAIL = "wait", "fail"
JSON: Final = "json:"
DURATIONS: Final = ("accept_within", "retry_after", "timeout")
ERRORS: Final = (ObjectiveState.IN_ERROR_FR, ObjectiveState.IN_ERROR_NFR, ObjectiveState.IN_ERROR_COMPONENT)
RESULTS: Final = {SUCCESS: Progress.SUCCESS.value, FAILURE: Progress.ERROR.value}
"""The report of the child's result; a metacontroller classifies it by the results of the skill."""


class ObjectiveDecorator(Decorator):
    """Has a metacontroller provide a skill with the required qualities, and ticks its child while a realization does.

        <Objective name="patrol_3" skill="to_navigate" requirements="safety: 0.5, energy: 0.5" status="{o_status}">
          <NavigateTo goal="{goal}"/>
        </Objective>

    The node's name is that of the objective. The child is also ticked while the objective is in error, as long as a
    realization is in force. While there is none, the child is halted and the decorator is RUNNING; or with
    ``on_error="fail"`` it fails. The child's result is reported, or the objective is cancelled if its skill has no such
    result. Its end is waited for, ``timeout`` at most; then the result is returned. A halt cancels the objective.

    An objective that ends meanwhile ends the child too: with SUCCESS if its skill has succeeded, else with FAILURE.
    A metacontroller that is lost fails nothing: the same objective is asked for again until it is back.
    """

    skill = Input(str, description="the skill that is to be provided")
    requirements = Input[Any](default="", description="bounds of qualities: safety: 0.5, energy <= 0.5")
    weights = Input[Any](default="", description="weights of qualities in the utility: safety: 2, energy: 1")
    curves = Input[Any](default="", description="utility curves of qualities: safety=0:0,0.5:0.2,1:1; energy=0:1,1:0")
    priority = Input(float, default=0.0, description="a higher one is decided first")
    always_improve = Input(bool, default=False, description="whether to change for a better realization without errors")
    realization = Input(str, default="", description="the realization to begin with")
    task = Input(str, default="", description="the task that it is for")
    inputs_port = Input[Any](
        name="inputs", default="json:{}", description="json:{...}, the inputs of the skill by name"
    )
    planner = Input(str, default="metacontrol", description="the metacontroller")
    on_error = Input(
        str, default=WAIT, description="wait or fail, while the objective is in error and nothing provides it"
    )
    accept_within = Input[Any](default="5s", description="how long an answer is waited for")
    retry_after = Input[Any](default="1s", description="pause before it is asked for again")
    timeout = Input[Any](default="5s", description="how long its end is waited for, when the child has ended")
    status_port = Output(str, name="status", description="its state, such as IN_PROGRESS or IN_ERROR_NFR")
    realization_out = Output(str, description="the realization in force, empty for none")
    mode_out = Output(str, description="the mode of that realization")
    qualities = Output(dict, description="the measured qualities by name")
    reasons = Output(str, description="why it is in error or not provided")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        """Act in the system of ``context``."""
        super().__init__(setup)
        self.context = context
        self._goal: ObjectiveGoal | None = None
        self._result: Status | None = None
        self._report: Asked[ObjectiveStatus] | None = None
        self._fails = False
        self._patience = self._until = 0.0

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports as far as the XML gives them; see `Node.adopt`."""
        super().adopt(children)
        require_ports(self, "skill")
        for port in DURATIONS:
            if is_known(self, port):
                duration_of(self, port)
        for port, read in self._quality_ports().items():
            if is_known(self, port):
                read()
        if is_known(self, "planner") and not PLANNER.fullmatch(self.planner):
            raise ValueError(f"port 'planner': '{self.planner}' cannot be a planner's name, such as metacontrol")
        if is_known(self, "on_error"):
            self._fails_on_error()
        text = self.setup.attributes.get("inputs", "")
        if '"' in text and not self.has_literal("inputs"):
            raise ValueError(f"port 'inputs': write json: before {text}, or it is taken for a blackboard key")
        if is_known(self, "inputs"):
            json_of(self, "inputs", dict)

    def tick(self) -> Status:
        """Take what has come, then tick the child, wait, or end; never block."""
        self.set_running()
        try:
            goal = self._goal or self._asked()
        except BAD_VALUES as error:
            self._write(None, str(error))
            return self._fail(str(error))
        goal.look(self.runtime.clock.now())
        self._write(goal.status, goal.refusal or goal.problem)
        status = self._advanced(goal) if self._result is None else self._ending(goal)
        if status == RUNNING:
            self._set_timer(goal)
        else:
            self._clear()
        return status

    def halt(self) -> None:
        """Cancel the objective, and halt the child."""
        self._clear()
        super().halt()

    # --- one tick ---

    def _advanced(self, goal: ObjectiveGoal) -> Status:
        """Tick the child if a realization is in force."""
        if goal.result is not None:
            self.child.reset()
            return self._of_end(goal.result)
        if goal.refusal:
            self.child.reset()
            return self._fail(goal.refusal)
        if goal.status is None or not goal.status.realization:
            self.child.reset()
            if self._fails and (goal.status.state in ERRORS if goal.status else goal.problem):
                return self._fail("; ".join(goal.status.reasons) if goal.status else goal.problem)
            return RUNNING
        status = self.child.execute_tick()
        if status == RUNNING:
            return RUNNING
        # The engine resets a child that completed, but not one that is skipped in the middle.
        self.child.reset()
        self._result = status
        self._until = self.runtime.clock.now() + self._patience
        if status == SKIPPED:
            goal.cancel()
        else:
            self._report = goal.report(RESULTS[status], max(self._patience, AT_ONCE))
        return self._ending(goal)

    def _ending(self, goal: ObjectiveGoal) -> Status:
        """Wait for the end of the objective; return the child's result then."""
        assert self._result is not None
        report = self._report
        if report is not None and report.done:
            self._report = None
            if report.answer is None or report.answer.progress is Progress.INPROGRESS:
                goal.cancel()
        is_late = self.runtime.clock.now() >= self._until - AT_ONCE
        # A goal that was lost is over, too: then the report alone ends the objective.
        has_ended = goal.is_over and (goal.result is not None or self._report is None)
        return self._result if has_ended or is_late else RUNNING

    def _of_end(self, ended: ObjectiveStatus) -> Status:
        """Return what the end of the objective means that nobody in this tree has asked for."""
        if ended.progress is Progress.SUCCESS:
            return SUCCESS
        if ended.progress is Progress.ERROR:
            return self._fail("its skill has ended in error")
        return self._fail("the objective was cancelled by another client")

    def _fail(self, reason: str) -> Status:
        write_if_connected(self, "reasons", reason)
        self.context.kit.log.warning("%s failed: %s", self.path, reason)
        return FAILURE

    # --- ports ---

    def _asked(self) -> ObjectiveGoal:
        """Ask for the objective that the ports describe now; raises what BAD_VALUES has."""
        self._fails, self._patience = self._fails_on_error(), duration_of(self, "timeout")
        bounds = self._bounds("requirements")
        objective = Objective(
            self.skill,
            "" if self.name == self.type_id else self.name,
            {name: bound.number for name, bound in bounds.items()},
            self.priority,
            self.always_improve,
            self._weights(),
            self._curves(),
            realization=self.realization,
            inputs=self._inputs(),
            task=self.task,
            operators={name: each.comparison for name, each in bounds.items() if each.comparison is not None},
        )
        planner = self.context.names.component(self.planner)
        times = (duration_of(self, "accept_within"), duration_of(self, "retry_after"))
        goal = ObjectiveGoal(self.context, planner, objective, *times)
        goal.ask()
        self._goal = goal
        return goal

    def _quality_ports(self) -> dict[str, Callable[[], object]]:
        return {
            "requirements": lambda: self._bounds("requirements"),
            "weights": self._weights,
            "curves": self._curves,
        }

    def _bounds(self, port: str) -> dict[str, Bound]:
        given = self.read_port(port)
        if isinstance(given, str) and not given.lstrip().startswith(JSON):
            texts = given.replace(";", ",").split(",")
        else:
            plain = json_of(self, port, dict)
            texts = [f"{name}: {number}" for name, number in plain.items()]
        try:
            return dict(read_bounds(text for text in texts if text.strip()))
        except ValueError as error:
            raise ValueError(f"port {port!r}: {error}") from None

    def _weights(self) -> dict[str, float] | None:
        found = self._bounds("weights")
        compared = next((each for each in found.values() if each.comparison is not None), None)
        if compared is not None:
            raise ValueError(f"port 'weights': {compared.quality}: a weight is written with ':' or '='")
        return {name: each.number for name, each in found.items()} or None

    def _curves(self) -> dict[str, tuple[CurvePoint, ...]] | None:
        given = self.read_port("curves")
        if isinstance(given, str) and not given.lstrip().startswith(JSON):
            texts = given.split(";")
        else:
            plain = json_of(self, "curves", dict)
            texts = [f"{name}={_points_text(points)}" for name, points in plain.items()]
        try:
            read = [read_curve(text) for text in texts if text.strip()]
        except ValueError as error:
            raise ValueError(f"port 'curves': {error}") from None
        found = {quality: tuple(CurvePoint(*point) for point in points) for quality, points in read}
        if len(found) < len(read):
            raise ValueError("port 'curves': a quality has two curves: leave one out")
        return found or None

    def _inputs(self) -> dict[str, PlainValue]:
        found: dict[str, PlainValue] = filled(json_of(self, "inputs", dict), self.blackboard)
        return found

    def _fails_on_error(self) -> bool:
        if self.on_error not in (WAIT, FAIL):
            raise ValueError(
                f"port 'on_error': there is no '{self.on_error}'; {instead_of(self.on_error, (WAIT, FAIL))}"
            )
        return self.on_error == FAIL

    def _write(self, status: ObjectiveStatus | None, problem: str) -> None:
        """Write all outputs, the last known where the metacontroller is lost."""
        state = status.state if status is not None else ObjectiveState.UNGROUNDED
        reasons = status.reasons if status is not None else ()
        write_if_connected(self, "status", state.value)
        write_if_connected(self, "realization_out", status.realization if status is not None else "")
        write_if_connected(self, "mode_out", status.mode if status is not None else "")
        write_if_connected(self, "qualities", dict(status.measured) if status is not None else {})
        write_if_connected(self, "reasons", "; ".join(filter(None, (problem, *reasons))))

    def _set_timer(self, goal: ObjectiveGoal) -> None:
        then = goal.again_at if self._result is None else self._until
        now = self.runtime.clock.now()
        if then is not None and then > now:
            self.runtime.timers.start(self.uid, then - now)
        else:
            self.runtime.timers.cancel(self.uid)

    def _clear(self) -> None:
        if self._goal is not None:
            self._goal.cancel()
        if self._report is not None:
            self._report.give_up()
        self.runtime.timers.cancel(self.uid)
        self._goal = self._report = self._result = None


def _points_text(points: PlainValue) -> str:
    """Return a list of pairs as a curve's text; anything else as a text that is none."""
    pairs = points if isinstance(points, list) else [points]
    return ",".join(
        ":".join(map(str, pair)) if isinstance(pair, list) and len(pair) == 2 else str(pair) for pair in pairs
    )
