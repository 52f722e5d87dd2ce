"""Which mode is to be entered now: settling, dwelling, manual changes, and circles."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import Any, Final

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.management.modes import RuleStatus, SystemModes
from regraft.bus_schema.model.adaptation import AdaptationReport, EnterMode
from regraft.bus_schema.model.expressions import Unknown
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.modes.mode_conditions import condition_of, target_of
from regraft.bus_schema.model.modes.mode_parts import entered_with, part_of

ROUNDING: Final = 1e-6
"""Seconds by which times may differ that are meant to be equal."""


@dataclass(frozen=True, slots=True)
class Times:
    """The parameters of a planner, in seconds, and how often a mode may be entered in ``circle_window``."""

    settle: float
    dwell: float
    manual_hold: float
    circle_window: float
    circle_limit: int
    circle_pause: float
    retry: float


@dataclass(slots=True)
class PartMemory:
    """The memory of a part: the target as it was last seen, what was asked for, and until when to wait.

    Modes are ``asked`` for on a revision: on that one they may still be entered where nobody has answered. It is 0
    for one that was answered, which counts until the targets are next seen.
    """

    target: str = ""
    as_asked: bool = True
    asked: dict[str, int] = field(default_factory=dict)
    dwell_until: float = 0.0
    manual_until: float = 0.0
    retry_at: float = 0.0
    entered: list[tuple[float, str, str]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Circling:
    """Rules of a part that led in a circle, and those of them that are suspended until ``until``."""

    part: str
    modes: tuple[str, ...]
    suspended: tuple[str, ...]
    until: float


def entered_by(actor: str, lines: Iterable[AdaptationReport], parts: Mapping[str, Collection[str]]) -> dict[str, str]:
    """Return the modes that somebody entered, by part, and nobody else has entered one of that part since.

    ``lines`` are those of the journal, newest first; ``parts`` are the modes that each mode enters.
    """
    last: dict[str, tuple[str, str]] = {}
    for line in lines:
        changes = line.request.changes if line.revision_after != line.revision_before else ()
        for change in reversed(changes):
            for mode in entered_with(change.mode, parts) if isinstance(change, EnterMode) else ():
                last.setdefault(part_of(mode), (mode, line.request.actor))
    return {part: mode for part, (mode, who) in last.items() if who == actor}


class Enforcement:
    """The state of all rules. Times are seconds of the component's clock."""

    def __init__(self, memory: Mapping[str, PlainValue] | None = None) -> None:
        """Begin, or continue from what ``remembered`` returned."""
        self.rules: tuple[ModeRule, ...] = ()
        self.suspended: dict[str, float] = {}
        self._since: dict[str, float] = {}
        self._unknown: dict[str, str] = {}
        self._fallen_since: dict[str, float] = {}
        self.parts: dict[str, PartMemory] = {}
        if memory:
            self.suspended = dict(memory["suspended"])
            for part, known in memory["parts"].items():
                entered = [(when, rule, mode) for when, rule, mode in known["entered"]]
                self.parts[part] = PartMemory(**{**known, "entered": entered})

    def remembered(self) -> dict[str, PlainValue]:
        """Return what a further run has to know, as plain data."""
        parts = {name: asdict(part) for name, part in self.parts.items()}
        for part in parts.values():
            part["entered"] = [list(each) for each in part["entered"]]
        return {"suspended": dict(self.suspended), "parts": parts}

    def take_rules(self, rules: Sequence[ModeRule]) -> None:
        """Enforce these rules from now on."""
        self.rules = tuple(rules)
        self._conditions = {rule.name: condition_of(rule) for rule in rules}

    # --- what is seen ---

    def see(
        self,
        modes: SystemModes,
        now: float,
        times: Times,
        own: Mapping[str, str] = MappingProxyType({}),
        *,
        final: bool = True,
    ) -> list[str]:
        """Take how all parts are; returns those whose mode others have changed, which is left alone for a while.

        ``own`` are the modes, by part, that an earlier run had entered, and may not have remembered. A revision that is
        not ``final`` may be undone: then the one before is back, with what was asked for on it.
        """
        changed = []
        for part in dict.fromkeys(map(target_of, self.rules)):
            seen = modes.part(part)
            target, as_asked = (seen.target, seen.as_asked) if seen else ("", True)
            memory = self.parts.get(part)
            if memory is None:
                self.parts[part] = PartMemory(target, as_asked)
                continue
            is_other = (target, as_asked) != (memory.target, memory.as_asked)
            is_own = bool(target) and (target in memory.asked or target == own.get(part))
            if is_other and not (as_asked and is_own):
                memory.manual_until = now + times.manual_hold
                changed.append(part)
            memory.target, memory.as_asked = target, as_asked
            memory.asked = {mode: on for mode, on in memory.asked.items() if on and (on == modes.revision or not final)}
        return changed

    def look(self, values: Mapping[str, Any], now: float, fallen: Collection[str] = ()) -> None:
        """Take the values of the names in conditions; a rule whose condition is not known does not hold.

        ``fallen`` are the modes that want more of a component than it does, though it has not failed.
        """
        self._fallen_since = {mode: self._fallen_since.get(mode, now) for mode in fallen}
        self._unknown.clear()
        for rule in self.rules:
            try:
                true = bool(self._conditions[rule.name].value(values))
            except Unknown as error:
                self._unknown[rule.name] = str(error)
                true = False
            if true:
                self._since.setdefault(rule.name, now)
            else:
                self._since.pop(rule.name, None)

    # --- what follows ---

    def due(self, now: float, times: Times) -> ModeRule | None:
        """Return the rule whose mode is to be entered now; of a part's rules that hold, the first one counts."""
        decided = set()
        for rule in self.rules:
            part = target_of(rule)
            memory = self.parts.get(part)
            if memory is None or part in decided or not self._counts(rule, memory, now, times):
                continue
            decided.add(part)
            since = self._fallen_since.get(rule.mode)
            fallen = since is not None and now >= since + times.retry - ROUNDING
            stands = memory.target == rule.mode and memory.as_asked and not fallen
            if not stands and now >= max(memory.dwell_until, memory.manual_until, memory.retry_at) - ROUNDING:
                return rule
        return None

    def _counts(self, rule: ModeRule, memory: PartMemory, now: float, times: Times) -> bool:
        since = self._since.get(rule.name)
        settle = times.settle if rule.settle is None else rule.settle
        if since is None or now < since + settle - ROUNDING or now < self.suspended.get(rule.name, 0.0):
            return False
        return not rule.start or memory.target in (*rule.start, rule.mode)

    def asking(self, rule: ModeRule, revision: int) -> None:
        """Note that a rule's mode is asked for: where the answer is lost, it is still known whose doing it was."""
        self.parts[target_of(rule)].asked[rule.mode] = revision

    def answered(self, rule: ModeRule) -> None:
        """Note that the mode of a rule waits no more: it counts as asked for until the targets are next seen."""
        self.parts[target_of(rule)].asked[rule.mode] = 0

    def refused(self, rule: ModeRule, now: float, times: Times) -> None:
        """Note that a mode could not be entered; it is tried again after a while."""
        self.parts[target_of(rule)].retry_at = now + times.retry

    def entered(self, rule: ModeRule, now: float, times: Times) -> Circling | None:
        """Note that a mode was entered; returns the circle that this closed, if it was once too often."""
        part = target_of(rule)
        memory = self.parts[part]
        memory.target, memory.as_asked = rule.mode, True
        memory.dwell_until = now + (times.dwell if rule.dwell is None else rule.dwell)
        memory.entered = [each for each in memory.entered if each[0] > now - times.circle_window]
        memory.entered.append((now, rule.name, rule.mode))
        if sum(mode == rule.mode for _, _, mode in memory.entered) < times.circle_limit:
            return None
        return self._suspend(part, memory, now + times.circle_pause)

    def _suspend(self, part: str, memory: PartMemory, until: float) -> Circling | None:
        """Suspend all rules of a circle but the one that is listed first: its mode is the one to stay in."""
        names = {name for _, name, _ in memory.entered}
        _, *others = [rule.name for rule in self.rules if rule.name in names]
        if not others:
            return None
        self.suspended |= dict.fromkeys(others, until)
        modes = tuple(dict.fromkeys(mode for _, _, mode in memory.entered))
        memory.entered.clear()
        return Circling(part, modes, tuple(others), until)

    def status(self, now: float) -> tuple[RuleStatus, ...]:
        """Return how each rule is."""
        return tuple(
            RuleStatus(
                rule.name,
                rule.mode,
                None if rule.name in self._unknown else rule.name in self._since,
                self._unknown.get(rule.name, ""),
                until if (until := self.suspended.get(rule.name)) and until > now else None,
            )
            for rule in self.rules
        )
