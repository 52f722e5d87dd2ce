"""Rules that lead in a circle: found by trying them in situations that their conditions distinguish.

The situations are combinations of states, failures, and numbers around those that conditions name. States that a mode
itself changes count. Expressions that compare measured values with each other are only sampled: a planner looks out
for circles at run time, too.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any, Final

from regraft.bus_schema.model.adaptation import Change, ChangeState
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Expression, Unknown
from regraft.bus_schema.model.lifecycle import State, is_at_most
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.modes.mode_conditions import (
    GONE,
    ConditionName,
    NameKind,
    condition_of,
    names_of,
    target_of,
    values_of_modes,
)
from regraft.bus_schema.model.modes.mode_parts import asked_after, entered_with, part_of
from regraft.bus_schema.model.modes.modes import GOALS

SLOW: Final = 10.0
"""Seconds for which a rule settles that may be part of a circle: it tries again what had failed."""
MAX_TRIALS: Final = 20_000
"""Situations, each with modes to begin with, that are tried for a group of rules; of more, as many are drawn."""
BASIC_STATES: Final = (State.ACTIVE.value, State.INACTIVE.value, State.UNCONFIGURED.value, GONE)

Situation = dict[str, Any]
Key = tuple[NameKind, str, str]


@dataclass(frozen=True, slots=True)
class Circle:
    """Rules that follow each other for ever, the modes on the way, and the situation in which they do."""

    rules: tuple[str, ...]
    modes: tuple[str, ...]
    situation: Mapping[str, Any]

    def __str__(self) -> str:
        """Return ``a > b > a while laser.failed is False``."""
        known = " and ".join(f"{name} is {value!r}" for name, value in self.situation.items())
        return f"{' > '.join(self.modes)}" + (f", for ever, while {known}" if known else ", for ever")


def find_circle(architecture: Architecture, changes: Mapping[str, Sequence[Change]]) -> Circle | None:
    """Return a circle of an architecture's rules, None if none was found; ``changes`` are those of its modes.

    Rules that cannot influence each other are tried by themselves: several robots have as many groups of rules. Rules
    that settle for long are left out.
    """
    quick = ([rule for rule in rules if (rule.settle or 0.0) < SLOW] for rules in groups(architecture, changes))
    searches = (_Search(architecture, changes, rules) for rules in quick if len(rules) > 1)
    return next((circle for search in searches for circle in search.circles()), None)


def groups(architecture: Architecture, changes: Mapping[str, Sequence[Change]]) -> list[tuple[ModeRule, ...]]:
    """Return the rules in groups, in their order: a mode that a rule of one enters means nothing to all others."""
    found: list[tuple[set[tuple[NameKind, str]], list[ModeRule]]] = []
    for rule in architecture.mode_rules:
        touched, rules = _touched(rule, architecture, changes), [rule]
        for other in [group for group in found if group[0] & touched]:
            found.remove(other)
            touched, rules = touched | other[0], other[1] + rules
        found.append((touched, rules))
    order = [rule.name for rule in architecture.mode_rules]
    return [tuple(sorted(rules, key=lambda rule: order.index(rule.name))) for _, rules in found]


def _touched(
    rule: ModeRule, architecture: Architecture, changes: Mapping[str, Sequence[Change]]
) -> set[tuple[NameKind, str]]:
    """Return the parts and states that a rule decides on or reads, of those that modes change."""
    entered = set(entered_with(rule.mode, architecture.mode_parts))
    found = {(NameKind.MODE, part_of(mode)) for mode in entered}
    moved = {change.component for each in changes.values() for change in each if isinstance(change, ChangeState)}
    own = {change.component for change in changes.get(rule.mode, ()) if isinstance(change, ChangeState)}
    found |= {(NameKind.STATE, component) for component in own}
    for known in names_of((rule,), architecture).values():
        if known.kind in (NameKind.MODE, NameKind.TARGET):
            found.add((NameKind.MODE, known.owner))
        elif known.kind in (NameKind.STATE, NameKind.ACTIVE) and known.owner in moved:
            found.add((NameKind.STATE, known.owner))
    return found


class _Search:
    def __init__(
        self, architecture: Architecture, changes: Mapping[str, Sequence[Change]], rules: Sequence[ModeRule]
    ) -> None:
        self._rules = rules
        self._parts = architecture.mode_parts
        self._conditions = [condition_of(rule) for rule in rules]
        self._names = names_of(rules, architecture)
        self._changes = changes

    def circles(self) -> Iterator[Circle]:
        for situation, asked in self._trials():
            circle = self._follow(dict(asked), dict(situation))
            if circle is not None:
                yield circle

    def _starts(self) -> dict[str, list[str]]:
        """Return the modes to begin with: for each part that rules decide on, each of its modes that they name."""
        modes: dict[str, list[str]] = {}
        for rule in self._rules:
            known = modes.setdefault(target_of(rule), [""])
            known += [mode for mode in (*rule.start, rule.mode) if mode not in known]
        return modes

    def _trials(self) -> Iterator[tuple[dict[Key, Any], dict[str, str]]]:
        """Yield situations, each with the modes that are asked for: all of them, or as many as may be tried."""
        numbers, texts = _constants(self._conditions)
        candidates = {key: _candidates(key[0], key[2], numbers, texts) for key in _keys(self._names)}
        starts = self._starts()
        values = [*candidates.values(), *starts.values()]
        if prod(map(len, values)) <= MAX_TRIALS:
            combinations: Iterator[tuple[Any, ...]] = itertools.product(*values)
        else:
            chance = random.Random(0)
            combinations = (tuple(map(chance.choice, values)) for _ in range(MAX_TRIALS))
        for combination in combinations:
            situation = dict(zip(candidates, combination, strict=False))
            if not any(_is_contrary(situation, key) for key in candidates):
                yield situation, dict(zip(starts, combination[len(candidates) :], strict=True))

    def _values(self, situation: Mapping[Key, Any], asked: Mapping[str, str]) -> Situation:
        found: Situation = dict(values_of_modes(self._names, asked, asked))
        for name, known in self._names.items():
            if known.kind is NameKind.ACTIVE:
                found[name] = situation[NameKind.STATE, known.owner, ""] == State.ACTIVE.value
            elif name not in found:
                found[name] = situation[known.kind, known.owner, known.field]
        return found

    def _follow(self, asked: dict[str, str], situation: dict[Key, Any]) -> Circle | None:
        """Follow the rules from a situation until none leads on, or it is the same again."""
        first = self._values(situation, asked)
        way: list[tuple[str, str, str]] = []
        seen: dict[Any, int] = {}
        while True:
            place = (tuple(sorted(asked.items())), tuple(sorted((str(k), str(v)) for k, v in situation.items())))
            if place in seen:
                loop = way[seen[place] :]
                modes = (*(start for _, start, _ in loop), loop[-1][2])
                told = {
                    name: first[name]
                    for name in first
                    if self._names[name].kind not in (NameKind.MODE, NameKind.TARGET)
                }
                return Circle(tuple(dict.fromkeys(rule for rule, _, _ in loop)), modes, told)
            seen[place] = len(way)
            rule = self._next(asked, self._values(situation, asked))
            if rule is None:
                return None
            way.append((rule.name, asked.get(target_of(rule), ""), rule.mode))
            asked = asked_after(asked, (rule.mode,), self._parts)
            self._enter(rule.mode, situation)

    def _next(self, asked: Mapping[str, str], values: Situation) -> ModeRule | None:
        """Return the rule that leads on; of a part's rules that hold, the first one counts."""
        decided = set()
        for rule, condition in zip(self._rules, self._conditions, strict=True):
            part = target_of(rule)
            now = asked.get(part, "")
            if part in decided or (rule.start and now not in rule.start and now != rule.mode):
                continue
            if not holds(condition, values):
                continue
            if now != rule.mode:
                return rule
            decided.add(part)
        return None

    def _enter(self, mode: str, situation: dict[Key, Any]) -> None:
        """Change the states as a mode does."""
        for change in self._changes.get(mode, ()):
            key = (NameKind.STATE, change.component, "")
            goals = GOALS.get(change.transition) if isinstance(change, ChangeState) else None
            if goals is None or key not in situation:
                continue
            now = situation[key]
            lower = now == GONE or is_at_most(State(now), goals[0])
            if goals[0] is State.ACTIVE or not lower:
                situation[key] = goals[0].value


def holds(condition: Expression, values: Mapping[str, Any]) -> bool:
    """Return whether a condition is known and true."""
    try:
        return bool(condition.value(values))
    except Unknown:
        return False


def _keys(names: Mapping[str, ConditionName]) -> list[Key]:
    found: list[Key] = []
    for known in names.values():
        if known.kind in (NameKind.MODE, NameKind.TARGET):
            continue
        kind = NameKind.STATE if known.kind is NameKind.ACTIVE else known.kind
        found.append((kind, known.owner, known.field))
    return list(dict.fromkeys(found))


def _constants(conditions: Sequence[Expression]) -> tuple[list[float], list[str]]:
    constants = [value for condition in conditions for value in condition.constants]
    numbers = sorted({float(value) for value in constants if not isinstance(value, bool | str)})
    return numbers, sorted({value for value in constants if isinstance(value, str)})


def _candidates(kind: NameKind, field: str, numbers: list[float], texts: list[str]) -> list[Any]:
    if kind is NameKind.STATE:
        known = [state.value for state in State]
        return list(dict.fromkeys((*BASIC_STATES, *(text for text in texts if text in known))))
    if kind is NameKind.FAILED or field == "satisfied":
        return [False, True]
    if not numbers:
        return [0.0, 1.0]
    between = [(one + other) / 2 for one, other in itertools.pairwise(numbers)]
    return sorted({numbers[0] - 1.0, *numbers, *between, numbers[-1] + 1.0})


def _is_contrary(situation: Mapping[Key, Any], key: Key) -> bool:
    """Return whether a component would have failed and be active: a failure ends that."""
    state = situation.get((NameKind.STATE, key[1], ""))
    return key[0] is NameKind.FAILED and bool(situation[key]) and state in (State.ACTIVE.value, State.INACTIVE.value)
