"""Rule tables: plans that are written in the tree's XML.

    rules="safety &lt; 0.09 || power > 5.0 : max_velocity -= 0.08 within [0.10, 0.26];
           safety > 0.15 || power &lt; 4.0 : max_velocity += 0.08 within [0.10, 0.26]"

Conditions and values are scripts over the blackboard. The first rule whose condition holds wins. A rule with an empty
entry cannot be evaluated, and then no later rule is evaluated either: the order of rules matters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from behavior_tree import Node
from regraft.bus_schema.model.adaptation import ChangeState, Connect, SetParameters
from regraft.bus_schema.model.lifecycle import DOWNWARD
from regraft.services.bt_executor.adaptation.rules.desired_changes import DesiredChange, Step, clamped
from regraft.services.bt_executor.adaptation.rules.rule_text import (
    ActionText,
    ConnectText,
    RuleText,
    SetText,
    StateText,
    read_table,
    shown,
)
from regraft.services.bt_executor.adaptation.rules.scripts import KnowingScript

STEPS: Final = ("+=", "-=")
TWO_THINGS: Final = "is to become two things; all actions of a rule are one change"


@dataclass(frozen=True, slots=True)
class Fired:
    """The rule that won, as its text, and what it asks for."""

    rule: str
    desired: tuple[DesiredChange, ...]


@dataclass(frozen=True, slots=True)
class _Setting:
    """A parameter's value or step, still to be computed."""

    component: str
    parameter: str
    operator: str
    value: KnowingScript
    low: KnowingScript | None
    high: KnowingScript | None

    def desired_change(self) -> DesiredChange | None:
        """Return what it comes to now, None if an entry that it needs holds nothing; raises ValueError."""
        value = self.value.value()
        low = self._bound(self.low, -math.inf)
        high = self._bound(self.high, math.inf)
        if value is None or low is None or high is None:
            return None
        if self.operator in STEPS:
            by = self._number(value)
            return Step(self.component, self.parameter, by if self.operator == "+=" else -by, low, high)
        if self.low is not None:
            value = clamped(self._number(value), low, high)
        return SetParameters(self.component, {self.parameter: value})

    def _bound(self, script: KnowingScript | None, without: float) -> float | None:
        if script is None:
            return without
        value = script.value()
        return None if value is None else self._number(value)

    def _number(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{self.component}.{self.parameter}: {value!r} is not a number")
        return value


@dataclass(frozen=True, slots=True)
class _Rule:
    text: str
    condition: KnowingScript | None
    actions: tuple[_Setting | Connect | ChangeState, ...]

    def holds(self) -> bool | None:
        return True if self.condition is None else self.condition.holds()


class RuleTable:
    """The rules of one decorator, compiled."""

    def __init__(self, table: str, node: Node, locations: Sequence[str], subjects: Sequence[str]) -> None:
        """Compile a table for a node.

        Args:
            table: The rules.
            node: The node on whose blackboard they look.
            locations: The components named by the node; a target without a component means the only one.
            subjects: The parameters that may be set; none for any.

        Raises:
            ValueError: a rule is not well-formed; names its number and text.
        """
        self._node = node
        self._locations = tuple(locations)
        self._subjects = frozenset(subjects)
        self._rules = []
        for number, text in enumerate(read_table(table), start=1):
            try:
                self._rules.append(self._compiled(text))
            except ValueError as error:
                raise ValueError(f"rule {number}, '{shown(text.text)}': {error}") from None

    def fired(self) -> Fired | None:
        """Return the first rule that holds, None if there is none, or if one before it cannot be evaluated.

        Raises:
            ValueError, ScriptError: a condition or value makes no sense with the data that is there.
        """
        for rule in self._rules:
            holds = rule.holds()
            if holds is None:
                return None
            if holds:
                desired = [
                    action.desired_change() if isinstance(action, _Setting) else action for action in rule.actions
                ]
                known = tuple(one for one in desired if one is not None)
                return Fired(rule.text, known) if len(known) == len(desired) else None
        return None

    def _compiled(self, rule: RuleText) -> _Rule:
        condition = KnowingScript(rule.condition, self._node) if rule.condition else None
        actions = tuple(self._action(action) for action in rule.actions)
        _check_at_once(actions)
        return _Rule(rule.text, condition, actions)

    def _action(self, action: ActionText) -> _Setting | Connect | ChangeState:
        if isinstance(action, StateText):
            return ChangeState(action.component or self._only_location(action.transition.value), action.transition)
        if isinstance(action, ConnectText):
            component, port = self._target(action.target)
            return Connect(component, port, action.topic)
        return self._setting(action)

    def _setting(self, action: SetText) -> _Setting:
        component, parameter = self._target(action.target)
        if self._subjects and parameter not in self._subjects:
            raise ValueError(f"sets '{parameter}', but adaptation_subject is {';'.join(sorted(self._subjects))}")
        low, high = (KnowingScript(text, self._node) if text else None for text in (action.low, action.high))
        if low and high and low.is_constant and high.is_constant and not _in_order(low.value(), high.value()):
            raise ValueError(f"'within [{action.low}, {action.high}]' holds nothing: the lower bound comes first")
        return _Setting(component, parameter, action.operator, KnowingScript(action.value, self._node), low, high)

    def _target(self, target: str) -> tuple[str, str]:
        component, _, name = target.rpartition(".")
        return component or self._only_location(target), name

    def _only_location(self, of_what: str) -> str:
        if len(self._locations) != 1:
            named = ";".join(self._locations) or "not given"
            raise ValueError(f"'{of_what}' does not name its component, and subject_location is {named}")
        return self._locations[0]


def _in_order(low: Any, high: Any) -> bool:
    are_numbers = isinstance(low, int | float) and isinstance(high, int | float)
    return are_numbers and low <= high


def _check_at_once(actions: Sequence[_Setting | Connect | ChangeState]) -> None:
    """Make sure that nothing is to become two things at once; steps add up. Raises ValueError."""
    steps: dict[tuple[str, str], bool] = {}
    downward: dict[str, bool] = {}
    for action in actions:
        if isinstance(action, ChangeState):
            is_down = action.transition in DOWNWARD
            if downward.setdefault(action.component, is_down) is not is_down:
                raise ValueError(f"{action.component} {TWO_THINGS}")
            continue
        is_step = isinstance(action, _Setting) and action.operator in STEPS
        target = action.component, action.port if isinstance(action, Connect) else action.parameter
        if not (steps.get(target, True) and (is_step or target not in steps)):
            raise ValueError(f"{'.'.join(target)} {TWO_THINGS}")
        steps[target] = is_step
