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
from regraft.bus_schema.model.modes.mode_parts import asked_after
from regraft.bus_schema.model.modes.modes import GOALS

MAX_SITUATIONS: Final = 5_000
"""Situations that are tried; of more, as many are drawn."""
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
    """Return a circle of an architecture's rules, None if none was found; ``changes`` are those of its modes."""
    rules = architecture.mode_rules
    if len(rules) < 2:
        return None
    search = _Search(architecture, changes)
    return next(search.circles(), None)


class _Search:
    def __init__(self, architecture: Architecture, changes: Mapping[str, Sequence[Change]]) -> None:
        self._rules = architecture.mode_rules
        self._parts = architecture.mode_parts
        self._conditions = [condition_of(rule) for rule in self._rules]
        self._names = names_of(self._rules, architecture)
        self._changes = changes

    def circles(self) -> Iterator[Circle]:
        starts = list(self._starts())
        for situation in self._situations():
            for asked in starts:
                circle = self._follow(dict(asked), dict(situation))
                if circle is not None:
                    yield circle

    def _starts(self) -> Iterator[dict[str, str]]:
        """Yield the modes to begin with: for each part that rules decide on, each of its modes that they name."""
        modes: dict[str, list[str]] = {}
        for rule in self._rules:
            known = modes.setdefault(target_of(rule), [""])
            known += [mode for mode in (*rule.start, rule.mode) if mode not in known]
        total = itertools.product(*modes.values())
        for combination in itertools.islice(total, MAX_SITUATIONS):
            yield dict(zip(modes, combination, strict=True))

    def _situations(self) -> Iterator[dict[Key, Any]]:
        numbers, texts = _constants(self._conditions)
        candidates = {key: _candidates(key[0], key[2], numbers, texts) for key in _keys(self._names)}
        keys, values = list(candidates), list(candidates.values())
        if prod(map(len, values)) <= MAX_SITUATIONS:
            combinations: Iterator[tuple[Any, ...]] = itertools.product(*values)
        else:
            chance = random.Random(0)
            combinations = (tuple(map(chance.choice, values)) for _ in range(MAX_SITUATIONS))
        for combination in combinations:
            situation = dict(zip(keys, combination, strict=True))
            if not any(_is_contrary(situation, key) for key in keys):
                yield situation

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
