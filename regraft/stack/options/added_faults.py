"""Adds faults to the schedule of a stack from the command line, checked as those of the stack file are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from regraft.bus_schema.model.scheduled_faults import FaultKind, ScheduledFault
from regraft.stack.sections.faults import overlapping, read_fault
from regraft.stack.stack import Stack
from regraft.stack.yaml.nodes import Location, Node, NumberTooLarge, scalar
from regraft.stack.yaml.problems import Problem, Report, StackError
from regraft.stack.yaml.section import Section

FIELDS = ("at", "component", "kind", "delay")
NUMBERS = ("at", "delay")
LOOKS = "must look like 'SECONDS COMPONENT KIND', such as '30 camera kill'; behind 'slow' may be a delay"


def with_faults(stack: Stack, texts: Sequence[str]) -> Stack:
    """Return the stack with faults added, each as ``SECONDS COMPONENT KIND``; a slow one may have its delay behind it.

    Raises:
        StackError: with everything that is wrong, each naming the fault.
    """
    problems: list[Problem] = []
    faults = list(stack.faults)
    for text in texts:
        report = Report(f"fault {text[:200]!r}")
        fault = _read(stack, text, report)
        problems += report.problems
        if fault is not None:
            faults.append(fault)
    if not problems and stack.architecture.simulated:
        problems = [Problem(f"fault '{fault}'", None, "", problem) for fault, problem in overlapping(faults)]
    if problems:
        raise StackError(problems)
    return replace(stack, faults=tuple(faults))


def _read(stack: Stack, text: str, report: Report) -> ScheduledFault | None:
    words = text.split()
    given = len(words)
    if given not in (3, 4) or (given == 4 and words[2] != FaultKind.SLOW.value):
        report.add("", LOOKS)
        return None
    place = Location(report.file)
    try:
        values = {
            field: Node(scalar(word) if field in NUMBERS else word, place)
            for field, word in zip(FIELDS, words, strict=False)
        }
    except NumberTooLarge as error:
        report.add("", str(error))
        return None
    return read_fault(Section(Node(values, place), "", report), stack.architecture)
