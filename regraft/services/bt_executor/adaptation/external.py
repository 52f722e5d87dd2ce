"""External strategies: the decorator gives the options and what they were worth; a planner chooses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

from regraft import CallFailed
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.planning import Proposal, ProposalRequest
from regraft.bus_schema.model.robots.planners import PROPOSE, planner_service
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.services.bt_executor.adaptation.dialogue import Asker, AttemptSteps
from regraft.services.bt_executor.adaptation.journal import decision_context
from regraft.services.bt_executor.adaptation.node import AdaptNode
from regraft.services.bt_executor.adaptation.port_values.names import read_names
from regraft.services.bt_executor.adaptation.port_values.options import option_space
from regraft.services.bt_executor.adaptation.port_values.ports import (
    duration_of,
    is_known,
    json_of,
    locations_of,
    subjects_of,
)
from regraft.services.bt_executor.adaptation.port_values.terms import BAD_VALUES
from regraft.services.bt_executor.adaptation.results import (
    NO_ANSWER,
    OUTCOMES,
    REJECTED,
    UNCHANGED,
    Result,
    refused,
    reported,
)
from regraft.services.bt_executor.adaptation.rules.scripts import KnowingScript, known_or_none
from regraft.services.bt_executor.adaptation.utility_meter import UtilityMeter

REFUSED: Final = "refused"
"""A planner's outcome if the adaptation manager did not take the adaptation up: nothing was touched."""


class ExternalStrategy:
    """Asks a planner for one decorator, and measures what its choices are worth.

    Utility is credited to the choice that earned it: it is measured from the time on at which the choice shows its
    effect until the next decision. An unanswered credit goes with the next request; a planner credits
    each choice once.
    """

    def __init__(self, node: AdaptNode) -> None:
        self._node = node
        self._meter = UtilityMeter()
        self._owed: dict[str, PlainValue] | None = None
        self._scripts: dict[str, KnowingScript] = {}
        self._problem = ""

    def check(self) -> None:
        """Compile the scripts that the XML gives; raises ValueError."""
        for port in ("utility", "condition"):
            if is_known(self._node, port) and isinstance(self._node.read_port(port), str):
                self._script(self._node.read_port(port))

    def measure(self) -> None:
        """Take a sample of the utility, while the child is at work; the next attempt is rejected if it makes none."""
        if not self._meter.ticket:
            return
        utility = None
        try:
            utility = self._utility()
        except BAD_VALUES as error:
            self._problem = str(error)
        self._meter.sample(self._node.now(), utility)

    def pause(self) -> None:
        """Measure nothing until the next sample: the child is not at work."""
        self._meter.pause(self._node.now())

    def attempt(self) -> AttemptSteps:
        """Have the planner choose, and its choice carried out."""
        node = self._node
        if self._problem:
            problem, self._problem = self._problem, ""
            return Result(REJECTED, f"utility: {problem}")
        settle = duration_of(node, "settle")
        condition = node.read_port("condition")
        if isinstance(condition, str) and not self._script(condition).holds():
            return None
        self._close_meter()
        asker = Asker(node.context, node.now(), duration_of(node, "timeout"))
        try:
            service = planner_service(node.context.names.component(node.read_port("planner")), PROPOSE)
            proposal = yield from asker.ask(SHARED + service, self._request(), Proposal, node.now())
        except CallFailed as error:
            return refused(error)
        except BadMessage as error:
            return Result(REJECTED, str(error))
        self._owed = None
        if proposal.report is not None:
            node.context.know_revision(proposal.report.revision_after)
        result = replace(_result(proposal), choice=proposal.choice)
        if proposal.ticket and result.good:
            since = proposal.choice.get("measure_from")
            if isinstance(since, bool) or not isinstance(since, int | float):
                since = node.now() + settle
            self._meter = UtilityMeter(proposal.ticket, since)
        return result

    def _close_meter(self) -> None:
        self._meter.pause(self._node.now())
        earned = self._meter.credit()
        if earned is not None:
            self._owed = earned
        self._meter = UtilityMeter()

    def _request(self) -> ProposalRequest:
        node = self._node
        given = node.setup.readers
        inputs: dict[str, PlainValue] = {}
        for port, name in (("adaptation_strategy", "strategy"), ("decision", "decision")):
            if port in given:
                inputs[name] = node.read_port(port)
        if "adaptation_options" in given:
            options = option_space(locations_of(node), subjects_of(node), node.read_port("adaptation_options"))
            inputs["options"] = [self._in_system(each) for each in options]
        if "options" in inputs or "settle" in node.setup.attributes:
            inputs["settle"] = duration_of(node, "settle")
        for port, kind in (("knobs", dict), ("constraints", list)):
            if port in given:
                inputs[port] = json_of(node, port, kind)
        if "inputs" in given:
            inputs |= json_of(node, "inputs", dict)
        if self._owed is not None:
            inputs["credit"] = self._owed
        context = {**decision_context(node.context, node, ""), **self._told()}
        task = (node.read_port("task") or node.path)[-200:]
        return ProposalRequest(task, node.because[:1000], node.path[-200:], True, inputs, context)

    def _in_system(self, dimension: dict[str, PlainValue]) -> dict[str, PlainValue]:
        """Return a dimension as it is one in the whole system; constraints and choices know it by its short name."""
        names = self._node.context.names
        component = dimension["component"]
        named = {**dimension, "component": names.component(component)}
        if named["component"] == component:
            return dimension
        if "topics" in dimension:
            named["topics"] = [names.topic(each) if isinstance(each, str) else each for each in dimension["topics"]]
        member = dimension.get("parameter") or dimension.get("port") or "transition"
        return {**named, "name": f"{component}.{member}"}

    def _told(self) -> dict[str, PlainValue]:
        """Return the entries for the planner; unknown ones are left out."""
        names = read_names(self._node.read_port("context"))
        found = {name: self._node.blackboard.find(f"@{name}") for name in names}
        values = {name: entry.value for name, entry in found.items() if entry is not None}
        return {name: value for name, value in values.items() if isinstance(value, int | float | str)}

    def _utility(self) -> float | None:
        value: Any = known_or_none(self._node.utility)
        if value is None and "utility" in self._node.setup.readers:
            value = known_or_none(lambda: self._node.read_port("utility"))
            if isinstance(value, str):
                value = self._script(value).value()
        return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None

    def _script(self, text: str) -> KnowingScript:
        if text not in self._scripts:
            # One that is written by the tree's logic may be another each time; only the newest are worth keeping.
            self._scripts = dict(list(self._scripts.items())[-3:])
            self._scripts[text] = KnowingScript(text, self._node)
        return self._scripts[text]


def _result(proposal: Proposal) -> Result:
    """Return what became of a proposal."""
    if proposal.report is not None:
        return reported(proposal.report)
    outcome = proposal.choice.get("outcome")
    if outcome == REFUSED:
        outcome = REJECTED
    elif outcome not in OUTCOMES:
        outcome = NO_ANSWER if proposal.changes else UNCHANGED
    if outcome == UNCHANGED:
        return Result(UNCHANGED)
    notes = proposal.choice.get("notes")
    why = "; ".join(str(note) for note in notes) if isinstance(notes, list) else ""
    return Result(str(outcome), why or "the planner gives no reason")
