"""Objectives as tables and lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from regraft.bus_schema.messages.management.objectives import ObjectivesStatus, ObjectiveStatus, Progress
from regraft.cli.terminal.output import plain_table, say, seconds, show_table

COLUMNS = ("objective", "skill", "state", "realization", "mode", "progress", "task")


def show_list(found: ObjectivesStatus) -> None:
    """Print a line for each objective, those that others require below these."""
    depths = _depths(found)
    show_table(COLUMNS, [_row(each, depths[each.objective]) for each in found.objectives], empty="no objectives")


def show_details(found: ObjectivesStatus) -> None:
    """Print all that is known of the first objective, and a line for each that it requires."""
    first, *required = found.objectives
    for line in details(first, found):
        say(line)
    for each in required:
        provided = f"by {each.realization}" if each.realization else "by nothing"
        say(f"requires {each.objective}: {each.state.value}, provided {provided}")


def details(objective: ObjectiveStatus, among: ObjectivesStatus) -> Iterator[str]:
    """Yield all that is known of an objective as lines."""
    yield f"objective: {objective.objective}"
    yield f"skill: {objective.skill}"
    if objective.task:
        yield f"task: {objective.task}"
    yield f"state: {objective.state.value}{', ended' if has_ended(objective) else ''}"
    yield f"realization: {objective.realization or 'none'}{_since(objective, among.stamp)}"
    if objective.mode:
        yield f"mode: {objective.mode}"
    if objective.why:
        yield f"why: {objective.why}"
    yield f"progress: {objective.progress.value}"
    yield f"priority: {objective.priority:g}"
    yield f"always improve: {'yes' if objective.always_improve else 'no'}"
    yield f"context: {among.context}"
    yield from quality_lines(objective)
    for reason in objective.reasons:
        yield f"reason: {reason}"
    for attempt in objective.attempts:
        ago = seconds(max(0.0, among.stamp - attempt.stamp))
        yield f"attempt: {attempt.realization}, {ago} ago: {attempt.why}"
    for name, until in among.resting.items():
        if name.startswith(f"{objective.objective}: "):
            yield f"resting: {name.partition(': ')[2]}, for {seconds(max(0.0, until - among.stamp))} more"


def has_ended(objective: ObjectiveStatus) -> bool:
    """Return whether an objective is over, or its skill is."""
    return objective.ended or objective.progress is not Progress.INPROGRESS


def quality_lines(objective: ObjectiveStatus) -> list[str]:
    """Return a table of qualities: what is required, measured and expected of each."""
    sources = (objective.requirements, objective.measured, objective.expected)
    names = sorted(set().union(*sources))
    rows = [[name, *(_number(source, name) for source in sources)] for name in names]
    return plain_table(("quality", "required", "measured", "expected"), rows) if rows else []


def _row(objective: ObjectiveStatus, depth: int) -> tuple[str, ...]:
    return (
        "  " * depth + objective.objective,
        objective.skill,
        objective.state.value,
        objective.realization,
        objective.mode,
        objective.progress.value,
        objective.task,
    )


def _depths(found: ObjectivesStatus) -> dict[str, int]:
    """Return by how many objectives each is required in turn; each comes before those that it requires."""
    depths: dict[str, int] = {}
    for each in found.objectives:
        depths[each.objective] = depths[each.parent] + 1 if each.parent in depths else 0
    return depths


def _since(objective: ObjectiveStatus, now: float) -> str:
    return "" if objective.since is None else f", for {seconds(max(0.0, now - objective.since))}"


def _number(source: Mapping[str, float], name: str) -> str:
    return f"{source[name]:.4g}" if name in source else ""
