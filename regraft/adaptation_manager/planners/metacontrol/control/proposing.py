"""A metacontroller as a planner: an objective as a proposal's inputs, and a decision as its choice."""

from __future__ import annotations

from dataclasses import replace

from regraft import RefusalCode, RequestRefused
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Decision
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.objectives import Objective
from regraft.bus_schema.messages.planning import ProposalRequest


def inputs_schema() -> dict[str, PlainValue]:
    """Return the JSON Schema of a proposal's inputs: those of an objective."""
    return record_shape(Objective).json_schema()


def objective_of(request: ProposalRequest) -> Objective:
    """Return the objective that a request is about, named as its task where it has no name; raises RequestRefused."""
    if not request.task:
        raise RequestRefused("is empty: name the objective", RefusalCode.MALFORMED, field="task")
    try:
        given: Objective = record_shape(Objective).unpack(request.inputs)
    except BadMessage as error:
        raise RequestRefused.malformed(error.inside("inputs")) from None
    return replace(given, name=given.name or request.task)


def choice_of(decision: Decision, outcome: str, notes: tuple[str, ...] = ()) -> dict[str, PlainValue]:
    """Return a decision as a proposal's choice."""
    return {
        "objective": decision.objective,
        "option": local_name(decision.design) if decision.design is not None else None,
        "status": str(decision.status),
        "why": decision.why,
        "outcome": outcome,
        "designs": [each.as_data() for each in decision.assessments],
        "notes": list(notes),
    }
