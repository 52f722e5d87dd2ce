"""One cycle of the loop: decide, and have the adaptation manager carry it out; what fails rests, the next is tried."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from regraft import Kit
from regraft.adaptation_manager.planners.manager_client import (
    NO_ANSWER,
    UNCHANGED,
    AdaptationOrder,
    CarriedOut,
    Manager,
)
from regraft.adaptation_manager.planners.metacontrol.control.deciding import Decided
from regraft.adaptation_manager.planners.metacontrol.control.modes import outcomes
from regraft.adaptation_manager.planners.metacontrol.control.modes.designs import DesignMode, Designs
from regraft.adaptation_manager.planners.metacontrol.control.modes.transaction import changes_to, in_force
from regraft.adaptation_manager.planners.metacontrol.control.proposing import choice_of
from regraft.adaptation_manager.planners.metacontrol.control.state import ControlState, Settings, why_left
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Objective
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Decision
from regraft.adaptation_manager.planners.modes.situation import fallen_out
from regraft.bus_schema.messages.management.system import SystemFaults, SystemStates
from regraft.bus_schema.messages.planning import Proposal
from regraft.bus_schema.model.adaptation import MAX_CONTEXT_SIZE, Change, EnterMode, plain_size
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.modes.mode_parts import asked_after

MAX_TRIES: Final = 8
"""Adaptations that one cycle tries at the most."""


class ReasonerFailed(Exception):
    """The analyse or plan step raised; the text is why."""


@dataclass(frozen=True, slots=True)
class Waits:
    """Seconds for which the adaptation manager may take to show the architecture, and to adapt."""

    answer: float
    adapt: float


@dataclass(frozen=True, slots=True)
class SystemHealth:
    """The states and faults of the system as they were published last."""

    states: SystemStates | None
    faults: SystemFaults | None


class Cycle:
    """The way from a decision to what is in force. ``notify`` is called when clients have something to see."""

    def __init__(self, kit: Kit, state: ControlState, notify: Callable[[], None]) -> None:
        self._kit = kit
        self._state = state
        self._notify = notify
        self._manager = Manager(kit)
        self._fallen: frozenset[str] = frozenset()
        self.trouble = ""
        self.latest: CarriedOut | None = None
        self.reasoning_time = 0.0

    async def run(self, settings: Settings, waits: Waits, system: SystemHealth, *, keep: bool) -> None:
        """Decide and carry out; raises RequestRefused if the manager cannot be asked, and ReasonerFailed."""
        architecture = await self._manager.architecture(waits.answer)
        for why in self._state.follow(architecture, self._kit.now()):
            self._kit.event("metacontrol.no_mode", why)
        for _ in range(MAX_TRIES):
            decided = self.decided(settings)
            self._state.take(decided, self._kit.now())
            self._notify()
            if await self._carry_out(decided, architecture, waits, system, keep=keep):
                return
            architecture = await self._manager.architecture(waits.answer)
            self._state.follow(architecture, self._kit.now())

    def decided(self, settings: Settings, further: Iterable[Objective] = ()) -> Decided:
        """Return a decision, also on ``further`` objectives; raises ReasonerFailed for any error."""
        begun = time.perf_counter()
        try:
            return self._state.decide(self._kit.now(), settings, further)
        except Exception as error:
            raise ReasonerFailed(f"{type(error).__name__}: {error}") from error
        finally:
            self.reasoning_time = time.perf_counter() - begun

    async def proposal(self, objective: Objective, settings: Settings, waits: Waits) -> Proposal:
        """Return what would be decided on one more objective, and changed; nothing is."""
        architecture = await self._manager.architecture(waits.answer)
        self._state.follow(architecture, self._kit.now())
        decided = self.decided(settings, () if objective.name in self._state.store else (objective,))
        decision = decided.plan.of(objective.name)
        designs = self._state.designs
        assert designs is not None
        assert decision is not None
        wanted = [designs.of(each.design) for each in decided.plan.decisions if each.design is not None]
        left = [designs.of(each.design) for each in self._state.groundings]
        return Proposal(objective.name, changes_to(wanted, left, architecture, {}), choice_of(decision, "dry"))

    async def _carry_out(
        self, decided: Decided, seen: Architecture, waits: Waits, system: SystemHealth, *, keep: bool
    ) -> bool:
        """Put what was decided in place; return whether the cycle is over."""
        designs = self._state.designs
        assert designs is not None
        wanted = [designs.of(each.design) for each in decided.plan.decisions if each.design is not None]
        kept = decided.kept(self._state.groundings, designs) if keep else ()
        wanted += [designs.of(each.design) for each in kept]
        left = [designs.of(each.design) for each in self._state.groundings]
        fallen = self._fallen_modes(wanted, seen, system)
        known = {
            each.component: each.state for each in (system.states.components if system.states else ()) if each.state
        }

        planned_on = seen

        def plan(architecture: Architecture) -> tuple[Change, ...]:
            nonlocal planned_on
            planned_on = architecture
            late = [each for each in map(designs.of, self._state.given_up) if in_force(each, architecture)]
            unwanted = [each for each in late if each not in wanted]
            return changes_to(wanted, [*left, *unwanted], architecture, known, fallen)

        if plan(seen):  # else nothing is put into words
            done = await self._manager.carry_out(plan, seen, self._order(decided), waits.adapt)
        else:
            done = CarriedOut((), UNCHANGED)
        self.latest = done
        entered = [
            each
            for each in decided.plan.decisions
            if each.design and (each.is_change or designs.of(each.design).mode in fallen)
        ]
        if done.stands:
            modes = [each.mode for each in done.changes if isinstance(each, EnterMode)]
            asked = asked_after(planned_on.asked_modes, modes, planned_on.mode_parts)
            self._state.carried_out(decided, asked, kept, self._kit.now())
            if done.report is not None:
                self._state.caught_up(done.report.revision_after)
            elif not planned_on.unconfirmed:  # else it may be undone: then the revision before is back
                self._state.caught_up(planned_on.revision)
            self.trouble = ""
            self._notify()
            return True
        if done.outcome == NO_ANSWER:
            self._state.give_up((each.design for each in wanted), planned_on.revision)
        return self._failed(entered, done, designs)

    def _failed(self, entered: Sequence[Decision], done: CarriedOut, designs: Designs) -> bool:
        """Let the designs rest that could not be entered; return whether the cycle is over."""
        why = done.problem
        if not outcomes.is_fault_of_designs(done) or not entered:
            self.trouble = f"the adaptation manager has not changed what was asked for: {why}"
            self._notify()
            return True
        components = outcomes.components_to_blame(done)
        self._state.failed(outcomes.to_blame(entered, designs, components), components, why, self._kit.now())
        return False

    def _fallen_modes(
        self, wanted: list[DesignMode], architecture: Architecture, system: SystemHealth
    ) -> frozenset[str]:
        """Return the modes in force of which a component does less than it should, though it has not failed.

        It may be on its way: only what was so at the last cycle already counts.
        """
        designs = self._state.designs
        assert designs is not None
        grounded = {designs.of(each.design).mode for each in self._state.groundings}
        present = [each for each in wanted if each.mode in grounded or in_force(each, architecture)]
        claims = {each.mode: tuple(each.claims) for each in present}
        now = frozenset(fallen_out(claims, architecture, system.states, system.faults))
        lasting, self._fallen = now & self._fallen, now
        return lasting

    def _order(self, decided: Decided) -> AdaptationOrder:
        """Return on whose behalf the adaptation is, and why, with the decision as its context as far as it fits."""
        decisions = decided.plan.decisions
        why = "; ".join(_reason(each) for each in decisions if each.is_change)
        whole = [each.as_data() for each in decisions]
        short = [{**each.as_data(), "designs": []} for each in decisions]
        room = MAX_CONTEXT_SIZE - 64
        fitting = next((each for each in (whole, short) if plain_size(each, room) <= room), [])
        context = {"context": self._state.monitor.context, "decisions": fitting}
        return AdaptationOrder(self._kit.name, why or "objectives have ended", context)


def _reason(decision: Decision) -> str:
    """Return why an objective has another design, and why the one before is left."""
    chosen = f"{decision.objective}: {local_name(decision.design) if decision.design else 'none'}"
    if decision.present is None:
        return f"{chosen}, as {decision.why}"
    return f"{chosen} in place of {local_name(decision.present)}: {why_left(decision)}"
