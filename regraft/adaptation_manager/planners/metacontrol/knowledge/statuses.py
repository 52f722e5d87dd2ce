"""One vocabulary of statuses. Those of published files are translated, anything else is refused.

TOMASys has INTERNAL_ERROR and EXTERNAL_ERROR, and booleans for components. MROS has IN_ERROR_FR, IN_ERROR_NFR and
IN_ERROR_COMPONENT, and texts for components. Published files mix both, in facts and in rules.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import (
    NUMBER,
    TEXT,
    TRUTH,
    Data,
    Term,
    local_name,
    text,
    truth,
)
from regraft.bus_schema.suggestions import instead_of


class Status(StrEnum):
    """The status of an objective, or of the grounding that solves it."""

    UNGROUNDED = "UNGROUNDED"
    IN_ERROR_FR = "IN_ERROR_FR"
    """The function is not fulfilled: its design could not be entered, or fails."""
    IN_ERROR_NFR = "IN_ERROR_NFR"
    """A measured quality breaks a requirement of the objective."""
    IN_ERROR_COMPONENT = "IN_ERROR_COMPONENT"
    """A component that the design requires has failed."""
    IN_PROGRESS = "IN_PROGRESS"


class ComponentStatus(StrEnum):
    """The status of a component. The values are those of MROS, so that its rules apply."""

    AVAILABLE = "TRUE"
    FAILED = "FALSE"
    RECOVERED = "RECOVERED"


class Direction(StrEnum):
    """Which values of a quality are better; requirements are lower or upper bounds accordingly."""

    HIGHER = "HIGHER"
    LOWER = "LOWER"


FALSE, TRUE = truth(False), truth(True)

STATUSES: Final[Mapping[Term, Term]] = {
    **{text(status): text(status) for status in Status},
    text("INTERNAL_ERROR"): text(Status.IN_ERROR_FR),
    # An external error is that of a required objective, which published files do not pass on: its kind is lost.
    text("EXTERNAL_ERROR"): text(Status.IN_ERROR_FR),
}
COMPONENT_STATUSES: Final[Mapping[Term, Term]] = {
    **{text(status): text(status) for status in ComponentStatus},
    TRUE: text(ComponentStatus.AVAILABLE),
    FALSE: text(ComponentStatus.FAILED),
}
TRUTHS: Final[Mapping[Term, Term]] = {TRUE: TRUE, FALSE: FALSE, text("TRUE"): TRUE, text("FALSE"): FALSE}
DIRECTIONS: Final[Mapping[Term, Term]] = {text(direction): text(direction) for direction in Direction}
OPERATORS: Final[Mapping[Term, Direction]] = {
    # The published operator is that of a violation: "<" means that a measured value below the bound breaks it.
    text("<"): Direction.HIGHER,
    text("<="): Direction.HIGHER,
    text(">"): Direction.LOWER,
    text(">="): Direction.LOWER,
}
NUMBERS: Final = frozenset(
    {vocabulary.HAS_VALUE, vocabulary.WEIGHT, vocabulary.LOWEST, vocabulary.HIGHEST, vocabulary.PRIORITY}
)
TEXTS: Final = frozenset({vocabulary.CONTEXT, vocabulary.CURVE})
VOCABULARIES: Final[Mapping[str, Mapping[Term, Term]]] = {
    **dict.fromkeys((vocabulary.O_STATUS, vocabulary.FG_STATUS, vocabulary.FG_ERROR), STATUSES),
    vocabulary.C_STATUS: COMPONENT_STATUSES,
    vocabulary.DIRECTION: DIRECTIONS,
    vocabulary.COMPARISON_OPERATOR: {value: value for value in OPERATORS},
    **dict.fromkeys(
        (
            vocabulary.B_STATUS,
            vocabulary.REALISABILITY,
            vocabulary.CC_AVAILABILITY,
            vocabulary.CC_UNIQUE,
            vocabulary.CSPEC_AVAILABILITY,
            vocabulary.UPDATABLE,
            vocabulary.ALWAYS_IMPROVE,
            vocabulary.IS_REST,
        ),
        TRUTHS,
    ),
}
KINDS: Final = {**dict.fromkeys(NUMBERS, NUMBER), **dict.fromkeys(TEXTS, TEXT)}


UPDATABLE: Final = text("UPDATABLE")


def normalized(predicate: str, value: Term) -> tuple[str, Term]:
    """Return a property and its value in the one vocabulary; raises ValueError that names what the value may be.

    >>> normalized(vocabulary.C_STATUS, truth(False))[1] == text("FALSE")
    True
    """
    if predicate == vocabulary.O_STATUS and value == UPDATABLE:
        return vocabulary.UPDATABLE, TRUE  # early files of MROS have it as a status
    return predicate, _normalized(predicate, value)


def _normalized(predicate: str, value: Term) -> Term:
    vocabulary = VOCABULARIES.get(predicate)
    if vocabulary is not None:
        if value not in vocabulary:
            allowed = [_plain(each) for each in vocabulary]
            raise ValueError(f"{local_name(predicate)} is {_plain(value)}; {instead_of(_plain(value), allowed)}")
        return vocabulary[value]
    kind = KINDS.get(predicate)
    if kind is not None and not (isinstance(value, Data) and value.kind == kind):
        raise ValueError(f"{local_name(predicate)} is {_plain(value)}, must be a {kind}")
    return value


def _plain(value: Term) -> str:
    if isinstance(value, str):
        return value
    if value.kind == TRUTH:
        return "true" if value.value else "false"
    return f'"{value.value}"' if value.kind == TEXT else str(value.value)
