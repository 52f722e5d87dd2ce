"""The component that enforces the rules of a stack: it has the manager enter modes."""

from __future__ import annotations

from typing import Final, TypeVar

from regraft import CallFailed, Component, Input, Level, Parameter, RequestRefused, service
from regraft.adaptation_manager.planners.manager_client import NO_ANSWER, AdaptationOrder, Manager
from regraft.adaptation_manager.planners.modes.enforcement import Circling, Enforcement, Times, entered_by
from regraft.adaptation_manager.planners.modes.situation import (
    Values,
    fallen_out,
    measured_values,
    values_of,
    wanted_by,
)
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.messages.management.modes import MODES, DeciderRequest, DeciderStatus, ModesRequest, SystemModes
from regraft.bus_schema.messages.management.system import (
    SystemFaults,
    SystemMeasurements,
    SystemQualities,
    SystemStates,
)
from regraft.bus_schema.model.adaptation import JOURNAL, AdaptationReport, Change, EnterMode, Outcome
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.description import Resources
from regraft.bus_schema.model.mode_rules import LONGEST, ModeRule
from regraft.bus_schema.model.modes.mode_conditions import ConditionName, NameKind, names_of, target_of
from regraft.bus_schema.model.modes.mode_deciders import DECIDER
from regraft.bus_schema.model.robots.scopes import SHARED

M = TypeVar("M")
News = tuple[SystemStates | None, SystemFaults | None, SystemQualities | None]

LOOK_EVERY: Final = 0.1
"""Seconds between two looks at the conditions."""
JOURNAL_LINES: Final = 20
"""Lines of the journal among which modes are looked for that an earlier run entered."""


def _seconds(default: float, description: str) -> Parameter[float]:
    return Parameter(default, description, minimum=0.0, maximum=LONGEST, unit="s")


class ModePlanner(Component):
    """Enters the modes that the rules of the stack prescribe; a system has one."""

    resources = Resources(cpu=0.01, memory=25.0)
    state_version = 2
    checkpoint_every = 0.5

    states = Input(SystemStates, topic="system/states", latest_only=True)
    faults = Input(SystemFaults, topic="system/faults", latest_only=True)
    requirements = Input(SystemQualities, topic="system/qualities", latest_only=True, required=False)
    measurements = Input(SystemMeasurements, topic="system/measurements", latest_only=True, required=False)
    adaptations = Input(AdaptationReport, topic="/adaptations", description="after each, the targets are read again")

    settle = _seconds(0.2, "how long a condition has to hold, where its rule says nothing")
    dwell = _seconds(1.0, "how long a mode stays that a rule has entered, where the rule says nothing")
    manual_hold = _seconds(30.0, "how long a mode that others have entered or left is left alone")
    retry = _seconds(1.0, "time until a mode is tried again that could not be entered")
    circle_window = _seconds(20.0, "in which a mode may be entered circle_limit times")
    circle_limit = Parameter(4, "how often rules enter a mode in circle_window before they are suspended", minimum=2)
    circle_pause = _seconds(60.0, "how long rules are suspended that lead in a circle, all but the first")
    answer_within = Parameter(5.0, "time that the adaptation manager may take to answer", minimum=0.1, unit="s")
    adapt_within = Parameter(30.0, "time that entering a mode may take", minimum=0.1, unit="s")

    def __init__(self) -> None:
        self._enforcement = Enforcement()
        self._stale: News = (None, None, None)

    def snapshot(self) -> PlainValue:
        """Return since when modes are left alone."""
        return self._enforcement.remembered()

    def restore(self, state: PlainValue) -> None:
        """Continue with what an earlier run has done."""
        self._enforcement = Enforcement(state)

    def on_activate(self) -> None:
        """Begin to look."""
        self._manager = Manager(self.kit)
        self._architecture: Architecture | None = None
        self._modes: SystemModes | None = None
        self._names: dict[str, ConditionName] = {}
        self._wanted: dict[str, tuple[str, ...]] = {}
        self._values = Values({}, {})
        self._seen_states: SystemStates | None = None
        self._complaint = ""
        self._is_new = True
        self.kit.spawn(self._enforce(), "enforcing rules")

    def on_deactivate(self) -> None:
        """Note what was read last: it may be wrong by the next activation, and that begins with newer messages."""
        self._stale = (self.states.latest, self.faults.latest, self.requirements.latest)

    @service(DECIDER)
    def status(self, request: DeciderRequest) -> DeciderStatus:
        """Report which rules hold, and what is left alone until when."""
        now = self.kit.now()
        held = {name: part.manual_until for name, part in self._enforcement.parts.items() if part.manual_until > now}
        return DeciderStatus(now, self._enforcement.status(now), held)

    @adaptations.handler
    def take(self, report: AdaptationReport) -> None:
        """Read the targets again after each change, also after one that was undone: it may have been read meanwhile."""
        if report.outcome is not Outcome.REJECTED:
            self._modes = None

    # --- looking ---

    def _times(self) -> Times:
        return Times(
            self.settle,
            self.dwell,
            self.manual_hold,
            self.circle_window,
            self.circle_limit,
            self.circle_pause,
            self.retry,
        )

    async def _enforce(self) -> None:
        while True:
            try:
                await self._look()
                self._complaint = ""
            except (CallFailed, RequestRefused) as error:
                self._complain(str(error))
            await self.kit.sleep(LOOK_EVERY)

    def _complain(self, text: str) -> None:
        if text != self._complaint:
            self._complaint = text
            self.kit.event("modes.undecided", text)

    async def _look(self) -> None:
        architecture, modes = await self._seen()
        states, faults, requirements = self._news()
        now = self.kit.now()
        measured = measured_values(self._names, states, self.measurements.latest, now)
        self._values = values_of(self._names, states, faults, requirements, modes, measured)
        self._enforcement.look(self._values, now, fallen_out(self._wanted, architecture, states, faults))
        rule = self._enforcement.due(now, self._times())
        if rule is not None:
            await self._enter(rule, architecture)

    def _news(self) -> News:
        """Return what the system publishes of itself, without what came before an inactive time."""
        states, faults, requirements = self._stale
        return (
            _newer(self.states.latest, states),
            _newer(self.faults.latest, faults),
            _newer(self.requirements.latest, requirements),
        )

    async def _seen(self) -> tuple[Architecture, SystemModes]:
        """Return the architecture and the modes, read again if they may be others; raises CallFailed."""
        of_modes = any(known.kind is NameKind.MODE for known in self._names.values())
        if of_modes and self.states.latest != self._seen_states:
            self._modes = None
        if self._architecture is not None and self._modes is not None:
            return self._architecture, self._modes
        self._seen_states = self.states.latest
        architecture = self._architecture = await self._manager.architecture(self.answer_within)
        self._enforcement.take_rules(architecture.mode_rules)
        self._names = names_of(architecture.mode_rules, architecture)
        self._wanted = wanted_by((rule.mode for rule in architecture.mode_rules), architecture)
        modes = await self.kit.call(SHARED + MODES, ModesRequest(), SystemModes, timeout=self.answer_within)
        own = await self._own_modes(architecture) if self._is_new else {}
        self._is_new = False
        final = not architecture.unconfirmed and architecture.revision == modes.revision
        for part in self._enforcement.see(modes, self.kit.now(), self._times(), own, final=final):
            whose = part or "the system"
            text = f"the mode of {whose} was changed by others: it is left alone for {self.manual_hold:g} s"
            self.kit.event("modes.manual", text, part=part)
        self._modes = modes
        return architecture, modes

    async def _own_modes(self, architecture: Architecture) -> dict[str, str]:
        """Return the modes that earlier runs of this planner entered last, by the journal."""
        journal = JournalRequest(limit=JOURNAL_LINES)
        page = await self.kit.call(SHARED + JOURNAL, journal, JournalPage, timeout=self.answer_within)
        return entered_by(self.kit.name, page.entries, architecture.mode_parts)

    # --- acting ---

    async def _enter(self, rule: ModeRule, architecture: Architecture) -> None:
        part = target_of(rule)
        before = self._enforcement.parts[part].target

        def plan(seen: Architecture) -> tuple[Change, ...]:
            if seen.asked_modes.get(part, "") != before:
                return ()
            self._enforcement.asking(rule, seen.revision)
            return (EnterMode(rule.mode),)

        why = f"rule {rule.name}: {rule.because or rule.when}"
        context = {name: value for name, value in self._values.items() if isinstance(value, bool | int | float | str)}
        order = AdaptationOrder(self.kit.name, why, context)
        self._enforcement.asking(rule, architecture.revision)
        self._modes = None
        done = await self._manager.carry_out(plan, architecture, order, self.adapt_within)
        now = self.kit.now()
        if done.outcome != NO_ANSWER:
            self._enforcement.answered(rule)
        if done.outcome == "unchanged":
            return  # somebody else was faster
        if not done.stands:
            self._enforcement.refused(rule, now, self._times())
            self._complain(f"rule {rule.name}: mode {rule.mode} could not be entered: {done.problem}")
            return
        circling = self._enforcement.entered(rule, now, self._times())
        if circling is not None:
            self._report(circling)

    def _report(self, circling: Circling) -> None:
        modes, rules = " > ".join(circling.modes), ", ".join(circling.suspended)
        text = f"rules lead in a circle, {modes}: suspended until {circling.until:.1f} s: {rules}"
        self.kit.event("modes.circle", text, part=circling.part, suspended=list(circling.suspended))
        self.kit.diagnose("mode rules", Level.ERROR, text)


def _newer(latest: M | None, stale: M | None) -> M | None:
    return None if latest is stale else latest
