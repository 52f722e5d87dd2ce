"""Checks a stack as a whole, and finds the line of the file of each violation."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.consistency import violations
from regraft.stack.files import file_problems
from regraft.stack.sections.hosts import FIRST
from regraft.stack.stack import time_sources

FIELD_IN_FILE = {"name": "", "resources": "", "description": ""}
"""Names of a component's fields that differ in the stack file; empty for fields that it lacks."""


def stack_problems(architecture: Architecture) -> Iterator[tuple[str, str]]:
    """Yield the dotted path in the file and the text of everything that is wrong.

    Where the class of a component is not known, neither is what it would read and write; connections and the source of
    time are not judged then, because most of it would be wrong. That a component lacks its class or its description is
    reported where it is read. Files that parameters name are judged by `file_problems_of`.
    """
    complete = all(spec.description or not spec.managed for spec in architecture.components.values())
    for violation in violations(architecture):
        told = violation.field in ("class", "description")
        guessed = not complete and violation.field.startswith("connect.")
        if not told and not guessed:
            yield field_in_file(violation), violation.problem
    if complete:
        yield from _time_problems(architecture)


def field_in_file(violation: Violation) -> str:
    """Return the dotted path in the stack file of what a violation is about."""
    if not violation.component:
        return violation.field
    first, _, rest = violation.field.partition(".")
    named = FIELD_IN_FILE.get(first, first)
    parts = ("components", violation.component, named, rest if named else "")
    return ".".join(part for part in parts if part)


def file_problems_of(architecture: Architecture) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with the files that components of this machine read: other hosts have files of their own."""
    for name, spec in architecture.components.items():
        if spec.description and spec.host == FIRST:
            for parameter, problem in file_problems(spec.description, spec.parameters):
                yield f"components.{name}.parameters.{parameter}", problem


def _time_problems(architecture: Architecture) -> Iterator[tuple[str, str]]:
    sources = time_sources(architecture)
    for name in sources:
        if architecture.components[name].host != FIRST:
            yield f"components.{name}.host", f"makes simulated time go on: must be on the first host, {FIRST!r}"
    if architecture.simulated and not sources:
        yield "clock", "simulated time needs a component that makes it go on, such as a world; there is none"
    elif architecture.simulated and len(sources) > 1:
        for name in sources:
            others = ", ".join(repr(other) for other in sources if other != name)
            yield (
                f"components.{name}.class",
                f"makes simulated time go on, as {others} does: must be only one",
            )
    elif not architecture.simulated:
        for name in sources:
            yield (
                f"components.{name}.class",
                "makes simulated time go on, but 'clock' is real: must be simulated",
            )
