"""The names that the condition of a mode rule may have, and what each is of."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

from regraft.bus_schema.encoding.reading_checks import ValueKind
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expression_kinds import kind_problems
from regraft.bus_schema.model.expressions import Expression
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.mode_rules import ModeRule
from regraft.bus_schema.model.modes.mode_parts import DEFAULT, SYSTEM, part_of
from regraft.bus_schema.suggestions import instead_of, no_such

GONE = "gone"
"""The state, in conditions, of a component that has no run."""
REQUIREMENTS = "qualities"
"""The first part of names that speak of quality requirements: ``qualities.MoveSafely.degree``."""


class NameKind(Enum):
    """The kinds of names in conditions, by the last part of the name; ``QUALITY`` is any other."""

    STATE = "state"
    ACTIVE = "active"
    FAILED = "failed"
    MODE = "mode"
    TARGET = "target"
    REQUIREMENT = "requirement"
    QUALITY = "quality"


OF_COMPONENTS = (NameKind.STATE, NameKind.ACTIVE, NameKind.FAILED)
OF_PARTS = (NameKind.MODE, NameKind.TARGET)
OF_REQUIREMENTS = ("satisfied", "degree", "metric")


@dataclass(frozen=True, slots=True)
class ConditionName:
    """A name in a condition: ``owner`` is a component, part or requirement, ``field`` a quality or a field of one."""

    kind: NameKind
    owner: str
    field: str = ""


def condition_of(rule: ModeRule) -> Expression:
    """Return a rule's condition; raises BadMessage if it is no expression."""
    return Expression(rule.when)


def read_name(name: str, architecture: Architecture) -> ConditionName:
    """Return what a name speaks of; raises BadMessage with what could have been meant."""
    owner, _, field = name.rpartition(".")
    if owner.partition(".")[0] == REQUIREMENTS and REQUIREMENTS not in architecture.components:
        return _requirement(name, owner, field)
    for kind in OF_PARTS:
        parts = {part_of(mode) for mode in architecture.modes}
        if field == kind.value and (owner in parts or owner not in architecture.components):
            if owner != SYSTEM and owner not in parts:
                raise BadMessage(f"{name}: {no_such('part with modes', owner, parts - {SYSTEM})}")
            return ConditionName(kind, owner)
    if not owner:
        raise BadMessage(f"{name!r} has no place in a condition: must be such as 'component.failed'")
    return _of_component(name, owner, field, architecture)


def _requirement(name: str, owner: str, field: str) -> ConditionName:
    requirement = owner.partition(".")[2]
    if not requirement or field not in OF_REQUIREMENTS:
        known = [f"{owner}.{each}" for each in OF_REQUIREMENTS] if requirement else ["qualities.NAME.degree"]
        raise BadMessage(f"{name}: requirements have no {field!r}; {instead_of(name, known)}")
    return ConditionName(NameKind.REQUIREMENT, requirement, field)


def _of_component(name: str, owner: str, field: str, architecture: Architecture) -> ConditionName:
    spec = architecture.components.get(owner)
    if spec is None:
        raise BadMessage(f"{name}: {no_such('component', owner, architecture.components)}")
    if not spec.managed:
        raise BadMessage(f"{name}: {owner} is unmanaged: it has no lifecycle, and reports nothing")
    for kind in OF_COMPONENTS:
        if field == kind.value:
            return ConditionName(kind, owner)
    described = spec.description
    quality = described.quality(field) if described else None
    if quality is not None and quality.measured:
        return ConditionName(NameKind.QUALITY, owner, field)
    known = [kind.value for kind in OF_COMPONENTS]
    known += [each.name for each in described.qualities if each.measured] if described else []
    raise BadMessage(f"{name}: {owner} has no {field!r} to decide by; {instead_of(field, known)}")


def names_of(rules: Iterable[ModeRule], architecture: Architecture) -> dict[str, ConditionName]:
    """Return what all names of the rules' conditions speak of; those that are wrong are left out."""
    named = (each for rule in rules for each in _names(rule, architecture))
    return {name: known for name, known, _ in named if known is not None}


def _names(rule: ModeRule, architecture: Architecture) -> Iterator[tuple[str, ConditionName | None, str]]:
    try:
        names = condition_of(rule).names
    except BadMessage:
        return
    for name in names:
        try:
            yield name, read_name(name, architecture), ""
        except BadMessage as error:
            yield name, None, str(error)


def condition_problems(rule: ModeRule, architecture: Architecture) -> list[str]:
    """Return what is wrong with a rule's condition."""
    try:
        names = condition_of(rule).names
    except BadMessage as error:
        return [str(error)]
    if not names:
        return [f"{rule.when!r} speaks of nothing that changes: must be a condition, such as: laser.failed"]
    problems = [problem for _, known, problem in _names(rule, architecture) if known is None]
    return problems or list(_misfits(rule, architecture)) or _wrong_kinds(rule, architecture)


def _wrong_kinds(rule: ModeRule, architecture: Architecture) -> list[str]:
    """Return what is no condition where one has to be. The name of a mode may be one: it is false where it is empty."""
    kinds = {name: _kind(known) for name, known in names_of((rule,), architecture).items()}
    given = {name: kind for name, kind in kinds.items() if kind is not None}
    return kind_problems(condition_of(rule), given, ValueKind.TRUTH)


def _kind(name: ConditionName) -> ValueKind | None:
    if name.kind in OF_PARTS:
        return None
    if name.kind is NameKind.STATE:
        return ValueKind.TEXT
    is_number = name.kind is NameKind.QUALITY or name.field in ("degree", "metric")
    return ValueKind.NUMBER if is_number else ValueKind.TRUTH


def _misfits(rule: ModeRule, architecture: Architecture) -> Iterator[str]:
    """Yield the comparisons that can never hold, for the value that a name is compared with."""
    known = names_of((rule,), architecture)
    for name, value in condition_of(rule).compared():
        kind, owner = known[name].kind, known[name].owner
        if kind is NameKind.STATE:
            states = [*(state.value for state in State), GONE]
            if value not in states:
                yield f"{name} is compared with {value!r}: {no_such('state', str(value), states)}"
        elif kind in OF_PARTS:
            modes = ["", DEFAULT, *(mode for mode in architecture.modes if part_of(mode) == owner)]
            if value not in modes:
                yield f"{name} is compared with {value!r}: {no_such('mode of it', str(value), modes[1:])}"
        elif isinstance(value, str):
            yield f"{name} is compared with the text {value!r}, and is none"


def target_of(rule: ModeRule) -> str:
    """Return the part whose mode a rule decides on."""
    return part_of(rule.mode)


def values_of_modes(
    names: Mapping[str, ConditionName], asked: Mapping[str, str], actual: Mapping[str, str]
) -> dict[str, str]:
    """Return the values of the names that speak of modes, where targets and actual modes are known by part."""
    found = {}
    for name, known in names.items():
        modes = {NameKind.TARGET: asked, NameKind.MODE: actual}.get(known.kind)
        if modes is not None:
            found[name] = modes.get(known.owner, "")
    return found
