"""Internal plans: the decorator knows what it wants, and asks the adaptation manager for it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from regraft import CallFailed
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.manager import ArchitectureRequest
from regraft.bus_schema.model.adaptation import ADAPT, ARCHITECTURE, AdaptationReport, AdaptationRequest, Change
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.services.bt_executor.adaptation.dialogue import Asker, AttemptSteps, Turns
from regraft.services.bt_executor.adaptation.journal import decision_context
from regraft.services.bt_executor.adaptation.node import AdaptNode
from regraft.services.bt_executor.adaptation.port_values.ports import (
    LOCATIONS,
    conditions_of,
    duration_of,
    is_known,
    locations_of,
    subjects_of,
)
from regraft.services.bt_executor.adaptation.results import REJECTED, UNCHANGED, Result, refused, reported
from regraft.services.bt_executor.adaptation.rules.desired_changes import (
    DesiredChange,
    Impossible,
    Step,
    current_value,
    resolved,
)
from regraft.services.bt_executor.adaptation.rules.rules import Fired, RuleTable
from regraft.services.bt_executor.adaptation.rules.scripts import known_or_none

FRESH_FOR: Final = 1.0
"""Seconds for which the architecture counts as known; a plan that wants what is so already asks no more often."""
MAX_TURNS: Final = 3
"""How often a decision is rebuilt because somebody else changed the architecture meanwhile."""


class NotKnown(Exception):
    """The plan needs the architecture, which has to be asked for first."""


class InternalPlan:
    """The plan of one decorator: a rule table, or the class's own ``plan``."""

    def __init__(self, node: AdaptNode) -> None:
        self._node = node
        self._table: RuleTable | None = None
        self._table_of: tuple[Any, ...] = ()
        self._architecture: Architecture | None = None
        self._published: Architecture | None = None
        self._known_at = 0.0
        self._was_read = False

    def check(self) -> None:
        """Compile the rules that the XML gives; raises ValueError."""
        readers = self._node.setup.readers
        given = [port for port in ("rules", *LOCATIONS, "adaptation_subject") if port in readers]
        if "rules" in given and all(is_known(self._node, port) for port in given):
            self._rules()

    def current(self, component: str, parameter: str) -> PlainValue:
        """Return what a parameter should be; raises NotKnown, Impossible."""
        self._was_read = True
        return current_value(self._published or self._known(), self._node.context.names.component(component), parameter)

    def forget(self) -> None:
        """Ask for the architecture before the next decision."""
        self._architecture = None

    def attempt(self) -> AttemptSteps:
        """Decide, and have it carried out."""
        patience = duration_of(self._node, "timeout") + duration_of(self._node, "confirm")
        asker = Asker(self._node.context, self._node.now(), patience)
        try:
            return (yield from self._pursued(asker))
        except CallFailed as error:
            return refused(error)
        except (Impossible, BadMessage) as error:
            return Result(REJECTED, str(error))

    def _pursued(self, asker: Asker) -> AttemptSteps:
        is_settled, result = self._by_topic()
        if is_settled:
            return result
        for _ in range(MAX_TURNS):
            fired = yield from self._decided(asker)
            if fired is None or not fired.desired:
                return None
            yield from self._learn(asker)
            architecture = self._known()
            changes = resolved(tuple(map(self._in_system, fired.desired)), architecture)
            if not changes:
                return Result(UNCHANGED)
            depends = self._was_read or any(isinstance(one, Step) for one in fired.desired)
            request = self._request(changes, fired.rule, architecture.revision if depends else None)
            self.forget()
            report = yield from asker.ask(SHARED + ADAPT, request, AdaptationReport, self._node.now())
            self._node.context.know_revision(report.revision_after)
            result = reported(report)
            if not _is_stale(report):
                break
        return result

    def _by_topic(self) -> tuple[bool, Result | None]:
        """Return whether nothing is to be done, by the architecture's topic, and the result: nobody is asked then.

        A change is decided again, by the architecture as the manager has it.
        """
        self._published = self._node.context.published_architecture()
        if self._published is None:
            return False, None
        try:
            fired = self._wanted()
            if fired is None or not fired.desired:
                return True, None
            changes = resolved(tuple(map(self._in_system, fired.desired)), self._published)
            return (False, None) if changes else (True, Result(UNCHANGED))
        except Impossible:
            return False, None
        finally:
            self._published = None

    def _in_system(self, desired: DesiredChange) -> DesiredChange:
        names = self._node.context.names
        if isinstance(desired, Step):
            return replace(desired, component=names.component(desired.component))
        return names.change(desired)

    def _decided(self, asker: Asker) -> Turns[Fired | None]:
        """Return what is wanted; a plan that asks for present values is asked again once they are known."""
        self._was_read = False
        try:
            return self._wanted()
        except NotKnown:
            yield from self._learn(asker)
            return self._wanted()

    def _wanted(self) -> Fired | None:
        if "rules" in self._node.setup.readers:
            return self._rules().fired()
        wanted: DesiredChange | list[DesiredChange] | tuple[DesiredChange, ...] | None = known_or_none(self._node.plan)
        if isinstance(wanted, list | tuple):
            return Fired("", tuple(wanted))
        return None if wanted is None else Fired("", (wanted,))

    def _rules(self) -> RuleTable:
        node = self._node
        made_of = (node.read_port("rules"), locations_of(node), subjects_of(node))
        if self._table is None or made_of != self._table_of:
            self._table, self._table_of = RuleTable(made_of[0], node, made_of[1], made_of[2]), made_of
        return self._table

    def _request(self, changes: tuple[Change, ...], rule: str, revision: int | None) -> AdaptationRequest:
        node = self._node
        return AdaptationRequest(
            changes,
            (node.because or rule or node.type_id)[:1000],
            node.path[-200:],
            revision,
            context=decision_context(node.context, node, rule),
            confirm=duration_of(node, "confirm"),
            watch=tuple(map(node.context.names.condition, conditions_of(node))),
        )

    # --- the architecture ---

    def _forget_if_old(self) -> None:
        if self._node.now() - self._known_at > FRESH_FOR:
            self.forget()

    def _known(self) -> Architecture:
        self._forget_if_old()
        if self._architecture is None:
            raise NotKnown
        return self._architecture

    def _learn(self, asker: Asker) -> Turns[None]:
        self._forget_if_old()
        if self._architecture is None:
            now = self._node.now()
            self._architecture = yield from asker.ask(SHARED + ARCHITECTURE, ArchitectureRequest(), Architecture, now)
            self._known_at = self._node.now()
            self._node.context.know_revision(self._architecture.revision)


def _is_stale(report: AdaptationReport) -> bool:
    """Return whether an adaptation was rejected only because the architecture had changed."""
    return [violation.field for violation in report.violations] == ["revision"]
