"""The leaf that has the running system changed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from behavior_tree import SUCCESS, Input, Node, Output, Status
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.model.adaptation import ADAPT, APPLIED, AdaptationReport, AdaptationRequest
from regraft.bus_schema.model.robots.scopes import SHARED
from regraft.services.bt_executor.leaves.asking_leaf import Asking, write_if_connected
from regraft.services.bt_executor.leaves.context import Asked
from regraft.services.bt_executor.leaves.plain_messages import as_plain, filled, has_references, make_message, read_json


class Adapt(Asking):
    """Asks the adaptation manager for an adaptation; succeeds when all of it was applied.

        <Adapt because="all is explored" changes='json:[
            {"change": "transition", "component": "detector", "transition": "activate"},
            {"change": "set_parameters", "component": "navigator", "parameters": {"max_velocity": "{speed}"}}]'/>

    The names are those of the mission's own robot; names that begin with ``/`` are shared. A text ``{key}`` within the
    JSON represents the value of a blackboard entry. An adaptation that was rejected or rolled back has changed nothing:
    that is a FAILURE with the reason. So is no answer in time, but then it may still be applied; a leaf that is halted
    does not take an adaptation back either.
    """

    required_ports = ("changes",)

    changes = Input[Any](description="json:[...], the list of changes")
    because = Input(str, default="", description="why, for the journal")
    service = Input(str, default=SHARED + ADAPT, description="the service that adapts")
    timeout = Input(float, default=30.0, description="seconds to wait for the answer")
    outcome = Output(str, description="how the adaptation ended")
    revision = Output(int, description="the architecture's revision afterwards")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the changes as far as the XML gives them; see `Node.adopt`."""
        super().adopt(children)
        if self.has_literal("changes"):
            changes = read_json(self.setup.attributes["changes"])
            if not has_references(changes):
                make_message({"changes": changes}, type_of(AdaptationRequest))

    def _request(self, changes: PlainValue) -> AdaptationRequest:
        plain = {"changes": changes, "reason": self.because, "actor": self.path}
        request = make_message(plain, type_of(AdaptationRequest))
        assert isinstance(request, AdaptationRequest)
        return request

    def ask(self) -> Asked[Any]:
        """Ask the manager."""
        given = self.read_port("changes")
        plain = read_json(given) if isinstance(given, str) else as_plain(given)
        request = self._request(filled(plain, self.blackboard))
        request = replace(request, changes=tuple(map(self.context.names.change, request.changes)))
        return self.context.call(self.service, request, AdaptationReport, timeout=self.timeout)

    def answered(self, answer: AdaptationReport) -> Status:
        """Succeed if it was applied."""
        write_if_connected(self, "outcome", answer.outcome.value)
        write_if_connected(self, "revision", answer.revision_after)
        if answer.outcome in APPLIED:
            return SUCCESS
        why = "; ".join(filter(None, (answer.error, *map(str, answer.violations)))) or "no reason given"
        return self.failed(f"the adaptation was {answer.outcome.value}: {why}")
