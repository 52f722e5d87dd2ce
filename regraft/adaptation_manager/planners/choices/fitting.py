"""Whether settings can be in an architecture at all, and what would be right where they cannot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from regraft.adaptation_manager.planners.choices.in_architecture import goal_of, spec_of
from regraft.adaptation_manager.planners.choices.settings import Kind, Setting
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import LASTING
from regraft.bus_schema.model.parameter_values import parameter_problem
from regraft.bus_schema.model.system_topics import SYSTEM_TOPICS
from regraft.bus_schema.model.wiring import connection_problem
from regraft.bus_schema.suggestions import instead_of, no_such

MAX_TOLD: Final = 10
"""Problems that a refusal names."""
FIELDS: Final = {
    Kind.PARAMETER: ("parameter", "values"),
    Kind.PORT: ("port", "topics"),
    Kind.TRANSITION: ("transitions", "transitions"),
}
"""The fields of a varied dimension that hold a setting's member and value."""


@dataclass(frozen=True, slots=True)
class Misfit:
    """A setting that cannot be: which part of it is wrong (``component``, ``member``, ``value``), and why."""

    slot: int
    alternative: int
    setting: Setting
    part: str
    why: str


def check_dimensions(slots: Sequence[Slot], architecture: Architecture) -> None:
    """Raise BadMessage for what of varied dimensions cannot be in an architecture; it names what could."""
    found = {(misfit.slot, misfit.part, misfit.why): misfit for misfit in misfits(slots, architecture)}
    wrong = [BadMessage(misfit.why, ("options", str(misfit.slot), _field(misfit))) for misfit in found.values()]
    if wrong:
        others = [str(problem) for problem in wrong[1:MAX_TOLD]]
        more = [f"and {len(wrong) - MAX_TOLD} more"] if len(wrong) > MAX_TOLD else []
        raise BadMessage("; ".join([wrong[0].why, *others, *more]), wrong[0].where)


def _field(misfit: Misfit) -> str:
    if misfit.part == "component":
        return "component"
    member, value = FIELDS[misfit.setting.kind]
    return member if misfit.part == "member" else value


def misfits(slots: Sequence[Slot], architecture: Architecture) -> Iterator[Misfit]:
    """Yield all settings of slots that cannot be in an architecture."""
    settings = [s for slot in slots for alternative in slot.alternatives for s in alternative.every_setting]
    changing = {setting.component for setting in settings if setting.kind in (Kind.PRESENCE, Kind.CLASS)}
    for index, slot in enumerate(slots):
        for number, alternative in enumerate(slot.alternatives):
            for setting in alternative.every_setting:
                problem = _problem(setting, architecture, changing)
                if problem:
                    yield Misfit(index, number, setting, *problem)


def _problem(setting: Setting, architecture: Architecture, changing: set[str]) -> tuple[str, str] | None:
    spec = architecture.components.get(setting.component)
    if setting.kind is Kind.PRESENCE:
        return _presence_problem(setting, spec)
    if spec is None:
        missing = no_such("component", setting.component, architecture.components)
        return None if setting.component in changing else ("component", missing)
    match setting.kind:
        case Kind.PARAMETER:
            return _parameter_problem(setting, spec, may_change=setting.component in changing)
        case Kind.PORT:
            return _port_problem(setting, spec, architecture, may_change=setting.component in changing)
        case Kind.HOST if setting.value not in architecture.hosts:
            return "value", no_such("host", str(setting.value), architecture.hosts)
        case Kind.STATE if goal_of(setting) not in LASTING:
            return "value", f"{setting.value!r} is no state to stay in: must be unconfigured, inactive or active"
    return None


def _presence_problem(setting: Setting, spec: ComponentSpec | None) -> tuple[str, str] | None:
    if setting.value is True and spec is None:
        return "component", f"{setting.component!r} is not there, and cannot be added without its class"
    if isinstance(setting.value, dict):
        try:
            spec_of(setting)
        except BadMessage as error:
            return "value", str(error)
    return None


def _parameter_problem(setting: Setting, spec: ComponentSpec, *, may_change: bool) -> tuple[str, str] | None:
    known = spec.description.parameters if spec.description else ()
    described = next((parameter for parameter in known if parameter.name == setting.member), None)
    if described is None:
        missing = f"{spec.name} has no parameter {setting.member!r}"
        return None if may_change else ("member", f"{missing}; {instead_of(setting.member, [p.name for p in known])}")
    if described.read_only:
        return None if may_change else ("member", f"{spec.name}.{setting.member} is read-only")
    wrong = parameter_problem(described, setting.value)
    return ("value", wrong) if wrong else None


def _port_problem(
    setting: Setting, spec: ComponentSpec, architecture: Architecture, *, may_change: bool
) -> tuple[str, str] | None:
    topic, ports = str(setting.value), spec.description.ports if spec.description else ()
    known = {*spec.connections, *(each.name for each in ports)}
    if setting.member not in known and not may_change:
        return "member", f"{spec.name} has no port {setting.member!r}; {instead_of(setting.member, known)}"
    if topic not in architecture.topics and topic not in SYSTEM_TOPICS:
        return "value", no_such("topic", topic, architecture.topics)
    port = next((each for each in ports if each.name == setting.member), None)
    problem = connection_problem(architecture.topics, port, topic) if port is not None and not may_change else None
    return ("value", problem) if problem else None
