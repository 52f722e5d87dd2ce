"""Diagnostics: each thing that is wrong with skills, with its place, severity and code."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Place

MAX_SHOWN: Final = 100
"""Diagnostics that are shown to people. JSON has all."""
LONGEST: Final = 500
"""Characters of a message: it may quote anything."""


class Severity(Enum):
    """Whether a file can be used as it is."""

    ERROR = "error"
    WARNING = "warning"


class Code(Enum):
    """The kinds of things that are wrong, for programs."""

    UNREADABLE = "unreadable"
    TOO_LARGE = "too_large"
    SYNTAX = "syntax"
    NO_SUCH_IMPORT = "no_such_import"
    IMPORT_CIRCLE = "import_circle"
    TOO_MANY_IMPORTS = "too_many_imports"
    UNKNOWN_SKILL = "unknown_skill"
    UNKNOWN_QUALITY = "unknown_quality"
    UNKNOWN_CONTEXT = "unknown_context"
    UNKNOWN_TYPE = "unknown_type"
    UNKNOWN_COMPONENT = "unknown_component"
    UNKNOWN_PARAMETER = "unknown_parameter"
    UNMANAGED_COMPONENT = "unmanaged_component"
    UNFIT_VALUE = "unfit_value"
    NO_SKILL = "no_skill"
    OTHER_SKILL = "other_skill"
    DECLARED_TWICE = "declared_twice"
    CASE_DIFFERS = "case_differs"
    SAME_NAME = "same_name"
    QUALITY_NOT_LISTED = "quality_not_listed"
    QUALITY_TWICE = "quality_twice"
    NO_ESTIMATE = "no_estimate"
    OUT_OF_RANGE = "out_of_range"
    BAD_RANGE = "bad_range"
    BAD_WEIGHT = "bad_weight"
    NO_WEIGHT = "no_weight"
    BAD_CURVE = "bad_curve"
    BAD_EXPRESSION = "bad_expression"
    BAD_NUMBER = "bad_number"
    WRONG_DIRECTION = "wrong_direction"
    NO_STATE = "no_state"
    UNREALISABLE = "unrealisable"
    DIFFERENT_PARAMETERS = "different_parameters"
    SEVERAL_CONFIGURATIONS = "several_configurations"
    PARAMETERS_IGNORED = "parameters_ignored"
    VALUE_IGNORED = "value_ignored"
    NO_DEFAULT_CONTEXT = "no_default_context"
    REST_TWICE = "rest_twice"
    NEVER_CHOSEN = "never_chosen"
    INDISTINGUISHABLE = "indistinguishable"
    REQUIREMENT_CIRCLE = "requirement_circle"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One thing that is wrong, and what would be right."""

    place: Place
    severity: Severity
    code: Code
    message: str

    def __str__(self) -> str:
        """Return ``navigation.skills:3:14: error: there is no skill 'to_navigat'``."""
        return f"{self.place}: {self.severity.value}: {self.message}"


@dataclass(slots=True)
class Findings:
    """The diagnostics found so far."""

    found: list[Diagnostic] = field(default_factory=list)

    def error(self, place: Place, code: Code, message: str) -> None:
        """Note a thing without which the file cannot be used."""
        self._add(place, Severity.ERROR, code, message)

    def warning(self, place: Place, code: Code, message: str) -> None:
        """Note a thing that is probably not meant."""
        self._add(place, Severity.WARNING, code, message)

    def _add(self, place: Place, severity: Severity, code: Code, message: str) -> None:
        shown = message if len(message) <= LONGEST else f"{message[:LONGEST]}…"
        self.found.append(Diagnostic(place, severity, code, shown))

    @property
    def has_errors(self) -> bool:
        """Whether one of them is an error."""
        return any(each.severity is Severity.ERROR for each in self.found)

    def in_order(self) -> tuple[Diagnostic, ...]:
        """Return each diagnostic once, by file, line and column."""
        unique = dict.fromkeys(self.found)
        files = {file: number for number, file in enumerate(dict.fromkeys(each.place.file for each in unique))}
        return tuple(sorted(unique, key=lambda each: (files[each.place.file], each.place.line, each.place.column)))


class SkillsError(Exception):
    """A file of skills that cannot be used; ``diagnostics`` has all that is wrong, warnings too."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        errors = [each for each in self.diagnostics if each.severity is Severity.ERROR]
        super().__init__("\n".join(shown(errors)))


def shown(diagnostics: Iterable[Diagnostic]) -> list[str]:
    """Return diagnostics as lines, the first of them and the number of the others."""
    lines = [str(each) for each in diagnostics]
    return [*lines[:MAX_SHOWN], *([f"and {len(lines) - MAX_SHOWN} more"] if len(lines) > MAX_SHOWN else [])]
