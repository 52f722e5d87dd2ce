"""Reads the faults on a schedule: ``faults`` of a stack file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.scheduled_faults import LONGEST, FaultKind, ScheduledFault
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.sections.hosts import FIRST
from regraft.stack.stack import time_sources
from regraft.stack.yaml.nodes import Node
from regraft.stack.yaml.section import Section

KINDS = tuple(kind.value for kind in FaultKind)


def read_faults(root: Section, architecture: Architecture) -> tuple[ScheduledFault, ...]:
    """Return the entries of the list ``faults``, which concern components of ``architecture``."""
    node = root.node("faults")
    if node is None:
        return ()
    if not isinstance(node.value, tuple):
        root.wrong("faults", f"must be a list, is {node.kind}")
        return ()
    items = Section(Node({str(i): part for i, part in enumerate(node.value)}), root.at("faults"), root.report)
    sections = [items.section(item) for item in items.names()]
    read = [(section, read_fault(section, architecture)) for section in sections]
    found = [(section, fault) for section, fault in read if fault is not None]
    if architecture.simulated:
        for section, problem in _overlaps(found):
            section.wrong("at", problem)
    return tuple(fault for _, fault in found)


def read_fault(section: Section, architecture: Architecture) -> ScheduledFault | None:
    """Return the fault that a map states, None if something is wrong with it."""
    section.only("at", "component", "kind", "delay", "back_after")
    for field in ("at", "component", "kind"):
        if field not in section:
            section.wrong(field, "is missing")
    before = len(section.report.problems)
    usual = ScheduledFault(0.0, "", FaultKind.KILL)
    kind = _kind(section)
    at = section.number("at", 0.0, LONGEST)
    delay = section.number("delay", 0.0, 60.0)
    back_after = section.number("back_after", 0.0, LONGEST)
    component = section.text("component")
    if component:
        _check_component(section, component, architecture)
    if kind is not None:
        _check_fields(section, kind, architecture)
    if at is None or kind is None or not component or len(section.report.problems) > before:
        return None
    return ScheduledFault(
        at,
        component,
        kind,
        usual.delay if delay is None else delay,
        usual.back_after if back_after is None else back_after,
    )


def _kind(section: Section) -> FaultKind | None:
    text = section.text("kind")
    if text in KINDS:
        return FaultKind(text)
    if text:
        section.wrong("kind", f"there is no kind {text!r} of fault; {instead_of(text, KINDS)}")
    return None


def _check_component(section: Section, name: str, architecture: Architecture) -> None:
    spec = architecture.components.get(name)
    if spec is None:
        section.wrong("component", f"there is no component {name!r}; {instead_of(name, architecture.components)}")
    elif not spec.managed:
        section.wrong("component", f"{name!r} is not managed: it has no lifecycle that could fail")
    elif spec.host != FIRST:
        section.wrong("component", f"{name!r} is on host {spec.host!r}: must be on the first host, {FIRST!r}")
    elif architecture.simulated and name in time_sources(architecture):
        section.wrong("component", f"{name!r} makes simulated time continue, and cannot fail by it")


def _check_fields(section: Section, kind: FaultKind, architecture: Architecture) -> None:
    if "delay" in section and kind is not FaultKind.SLOW:
        section.wrong("delay", f"is for 'slow': leave it out of {kind.value!r}")
    if "back_after" in section and not kind.ends_the_run:
        section.wrong("back_after", f"the run of a component continues after {kind.value!r}: leave it out")
    elif "back_after" in section and not architecture.simulated:
        section.wrong("back_after", "is simulated time: leave it out, since 'restart' rules under the real clock")


def overlapping(faults: Iterable[ScheduledFault]) -> Iterator[tuple[ScheduledFault, str]]:
    """Yield the faults of components that are still gone then, and why that cannot be."""
    gone: dict[str, ScheduledFault] = {}
    for fault in sorted(faults, key=lambda fault: fault.at):
        before = gone.get(fault.component)
        if before is not None and fault.at < before.until:
            yield fault, f"{fault.component!r} is gone from {before.at:g} s to {before.until:g} s"
        elif fault.kind.ends_the_run:
            gone[fault.component] = fault


def _overlaps(found: list[tuple[Section, ScheduledFault]]) -> Iterator[tuple[Section, str]]:
    places = {id(fault): section for section, fault in found}
    for fault, problem in overlapping(fault for _, fault in found):
        yield places[id(fault)], problem
