"""The ``inputs`` of a proposal's request that lists what is to be varied, read and checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Final

from regraft.adaptation_manager.planners.choices.rules.constraints import OPERATORS
from regraft.adaptation_manager.planners.choices.settings import Kind, identity
from regraft.adaptation_manager.planners.choices.slots import Slot, varied
from regraft.bus_schema.annotations import Bounds, PlainValue, Seconds, Text
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.lifecycle import Transition

MAX_DIMENSIONS: Final = 64
MAX_CHOICES: Final = 1000
MAX_CONSTRAINTS: Final = 200
MAX_SETTLING: Final = 3600.0

Name = Annotated[str, Text(200)]


@dataclass(frozen=True, slots=True)
class Varied:
    """One dimension: ``parameter`` and ``values``, or ``port`` and ``topics``, or ``transitions``, of a component.

    Constraints know it by ``name``; without one, by ``component.parameter``, ``component.port`` or
    ``component.transition``.
    """

    component: Name
    parameter: Name = ""
    values: tuple[PlainValue, ...] = ()
    port: Name = ""
    topics: tuple[str, ...] = ()
    transitions: tuple[Transition, ...] = ()
    name: Name = ""

    def slot(self) -> Slot:
        """Return the slot in which this is varied; raises BadMessage."""
        given = {name for name in ("parameter", "values", "port", "topics", "transitions") if getattr(self, name)}
        if given == {"parameter", "values"}:
            kind, member, choices = Kind.PARAMETER, self.parameter, self.values
        elif given == {"port", "topics"}:
            kind, member, choices = Kind.PORT, self.port, self.topics
        elif given == {"transitions"}:
            kind, member, choices = Kind.TRANSITION, "", tuple(t.value for t in self.transitions)
        else:
            found = ", ".join(sorted(given)) or "none of them"
            raise BadMessage(f"must have parameter and values, or port and topics, or transitions; has {found}")
        if Transition.SHUTDOWN in self.transitions:
            raise BadMessage("shutdown ends a component for good, and is no option", ("transitions",))
        _check_choices(choices)
        name = self.name or f"{self.component}.{member or 'transition'}"
        return varied(self.component, kind, member, choices, name)


@dataclass(frozen=True, slots=True)
class ChoiceInputs:
    """The form of the inputs on the wire."""

    strategy: Name
    options: tuple[Varied, ...]
    knobs: dict[str, PlainValue] = field(default_factory=dict)
    constraints: tuple[PlainValue, ...] = ()
    settle: Annotated[Seconds, Bounds(0.0, MAX_SETTLING)] = 0.0
    credit: dict[str, PlainValue] | None = None


@dataclass(frozen=True, slots=True)
class Asked:
    """A request whose form is right; the strategies and the architecture may still not fit it."""

    strategy: str
    knobs: dict[str, PlainValue]
    slots: tuple[Slot, ...]
    constraints: tuple[PlainValue, ...]
    settle: float
    credit: dict[str, PlainValue] | None


def read_inputs(plain: dict[str, PlainValue]) -> Asked:
    """Return what is asked for; raises BadMessage naming what is wrong, and where."""
    inputs: ChoiceInputs = record_shape(ChoiceInputs).unpack(plain)
    slots = _slots(inputs.options)
    if len(inputs.constraints) > MAX_CONSTRAINTS:
        raise BadMessage(f"are {len(inputs.constraints)}, must be at most {MAX_CONSTRAINTS}", ("constraints",))
    return Asked(inputs.strategy, inputs.knobs, slots, inputs.constraints, inputs.settle, inputs.credit)


def _slots(options: Sequence[Varied]) -> tuple[Slot, ...]:
    if not 1 <= len(options) <= MAX_DIMENSIONS:
        raise BadMessage(f"are {len(options)}, must be 1 to {MAX_DIMENSIONS}", ("options",))
    found: list[Slot] = []
    for index, each in enumerate(options):
        try:
            slot = each.slot()
            _check_new(slot, found)
        except BadMessage as error:
            raise error.inside(str(index)).inside("options") from None
        found.append(slot)
    return tuple(found)


def _check_choices(choices: Sequence[PlainValue]) -> None:
    if len(choices) > MAX_CHOICES:
        raise BadMessage(f"has {len(choices)} choices, must have at most {MAX_CHOICES}")
    seen: set[str] = set()
    for choice in choices:
        if identity(choice) in seen:
            raise BadMessage(f"has {choice!r} twice")
        seen.add(identity(choice))


def _check_new(slot: Slot, others: Sequence[Slot]) -> None:
    for other in others:
        one, another = (each.alternatives[0].settings[0] for each in (slot, other))
        if (one.component, one.kind, one.member) == (another.component, another.kind, another.member):
            raise BadMessage(f"varies {slot.name} again: give all its choices in one place")
        if other.name == slot.name:
            raise BadMessage(f"there is another {slot.name!r}: give it a 'name' of its own", ("name",))


def inputs_schema(strategies: Sequence[str]) -> dict[str, Any]:
    """Return the JSON Schema of the inputs."""
    schema = record_shape(ChoiceInputs).json_schema()
    schema["description"] = (
        "A strategy, the options that it chooses from, and the utility that an earlier choice earned."
    )
    fields = schema["properties"]
    fields["strategy"] = {"enum": list(strategies)}
    fields["options"] |= {"minItems": 1, "maxItems": MAX_DIMENSIONS}
    transitions = [transition.value for transition in Transition if transition is not Transition.SHUTDOWN]
    fields["options"]["items"]["properties"]["transitions"]["items"] = {"enum": transitions}
    number = {"type": "number"}
    fields["credit"] = {
        "type": "object",
        "properties": {"ticket": {"type": "string"}, "utility": number, "from": number, "to": number},
        "required": ["ticket", "utility", "from", "to"],
        "additionalProperties": False,
    }
    when = {
        "type": "object",
        "minProperties": 1,
        "description": f"tests by dimension; operators: {' '.join(OPERATORS)}",
    }
    forms = ({"forbid": when}, {"if": when, "then": when}, {"compare": {"type": "array", "minItems": 3, "maxItems": 3}})
    because = {"because": {"type": "string"}}
    fields["constraints"] = {
        "type": "array",
        "maxItems": MAX_CONSTRAINTS,
        "items": {
            "oneOf": [
                {"type": "object", "properties": f | because, "required": list(f), "additionalProperties": False}
                for f in forms
            ]
        },
    }
    return schema
