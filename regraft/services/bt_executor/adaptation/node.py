"""The view that plans, strategies and attempts have of their decorator: ports, time, the author's overrides."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from behavior_tree import Decorator, Input, NodeSetup, Output
from regraft.bus_schema.annotations import PlainValue
from regraft.services.bt_executor.adaptation.dialogue import AttemptSteps
from regraft.services.bt_executor.adaptation.port_values.ports import FOR_PLANNERS, locations_of, subjects_of
from regraft.services.bt_executor.adaptation.results import Result
from regraft.services.bt_executor.adaptation.rules.desired_changes import DesiredChange
from regraft.services.bt_executor.leaves.context import LeafContext


class AdaptNode(Decorator):
    """The ports of all adapt decorators, and what their authors override."""

    adaptation_strategy = Input(str, description="the strategy that chooses among the options")
    adaptation_subject = Input[Any](description="parameters to adapt, as a;b; for strategies also port:NAME, lifecycle")
    subject_location = Input[Any](description="the components to adapt, as a;b")
    adaptation_location = Input[Any](description="the same as subject_location")
    adaptation_options = Input[Any](description="what to choose from: 0.1;0.2, with several subjects 0.1;0.2 | 1;3")
    decision = Input(str, description="the decision that the planner takes, by its name")
    inputs_port = Input[Any](name="inputs", description="json:{...}, further inputs of the planner, of any form")
    rules = Input(str, description="CONDITION : ACTION; CONDITION : ACTION; the first that holds wins")
    condition = Input[Any](default="true", description="script: whether to ask the strategy")
    utility_port = Input[Any](name="utility", description="script or entry: what the option that stands is worth")
    knobs = Input[Any](description="json:{...}, settings of the strategy")
    constraints = Input[Any](description="json:[...], which options do not go together")
    context_port = Input[Any](name="context", default="", description="root entries for the planner: a;b")
    settle = Input[Any](default="1s", description="how long after a change its effect can be measured")
    planner = Input(str, default="bandits", description="the planner that knows the strategy")
    task = Input(str, default="", description="the name under which the planner learns; by default the node's path")
    because = Input(str, default="", description="why, for the journal")
    timeout = Input[Any](default="5s", description="how long the answer is waited for")
    confirm = Input[Any](default="0s", description="how long it is watched before it is final; by rules and plans")
    watch = Input[Any](default="", description="json:[...], what must hold meanwhile, or requirements as a;b")
    retry_after = Input[Any](default="1s", description="pause after an adaptation that came to nothing")
    on_rejected = Input(str, default="ignore", description="ignore, fail, retry, retry 5, retry 5 then fail")
    on_rolled_back = Input(str, default="ignore", description="the same, after a failure that was undone")
    on_stuck = Input(str, default="ignore", description="the same, after a failure that could not be undone")
    on_no_answer = Input(str, default="ignore", description="the same, if nobody answered in time")
    outcome = Output(str, description="how the last adaptation ended")
    reason = Output(str, description="why it came to nothing; empty if it did not")
    choice_port = Output(str, name="choice", description="a planner's last choice: 0.18, of several subjects 0.18 | 1")
    option_port = Output(dict, name="option", description="the same by name, as in {'navigator.max_velocity': 0.18}")
    why_port = Output(str, name="why", description="why the planner chose it")

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        """Act in the system of ``context``."""
        super().__init__(setup)
        self.context = context

    # --- for authors ---

    def plan(self) -> DesiredChange | list[DesiredChange] | tuple[DesiredChange, ...] | None:
        """Return what to change, None for nothing; override it.

        It may be asked more often than adaptations are made, so it changes nothing of the node's own: what a plan
        remembers it sets in ``adapted``. ``Step`` changes a number from its value at that time.
        """
        raise NotImplementedError(f"{type(self).__name__} does not implement plan()")

    def utility(self) -> float | None:
        """Return what the present option is worth now, None if that is not known; override it, or use the port."""
        return None

    def adapted(self, result: Result) -> None:
        """Take notice of an adaptation that was applied; override it to remember something."""

    def target(self) -> tuple[str, str]:
        """Return the one component and parameter that the ports name; raises ValueError if they name more or none."""
        locations, subjects = locations_of(self), subjects_of(self)
        if len(locations) != 1 or len(subjects) != 1:
            raise ValueError(f"{self.type_id} needs one component in subject_location, one name in adaptation_subject")
        return locations[0], subjects[0]

    # --- for the attempt ---

    @property
    def is_external(self) -> bool:
        """Whether a planner chooses."""
        return any(port in self.setup.readers for port in FOR_PLANNERS)

    def now(self) -> float:
        """Return the time in seconds of the tree's clock."""
        return self.runtime.clock.now()

    def attempt(self) -> AttemptSteps:
        """Decide, and have it carried out."""
        raise NotImplementedError

    def tell_choice(self, choice: Mapping[str, PlainValue]) -> None:
        """Report what a planner has chosen, also if that could not be applied, or is in force already."""
        raise NotImplementedError

    def tell(self, result: Result) -> None:
        """Report how an adaptation ended."""
        raise NotImplementedError
