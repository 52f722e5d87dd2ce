"""``regraft mission replay``: what a mission did, from a recording."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from regraft.bus_schema.messages.mission import MissionNode
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.numbers import seconds, whole
from regraft.cli.terminal.options import JsonOption
from regraft.cli.terminal.output import say, show_json
from regraft.services.bt_executor.authors.showing import named, tree_lines

if TYPE_CHECKING:
    from regraft.services.bt_executor.observing.recording import Step

LONGEST = 1e12
QUIT = "q"
RecordingArgument = Annotated[Path, typer.Argument(metavar="RECORDING", help="A file that an executor recorded.")]
AtOption = Annotated[
    float | None,
    typer.Option("--at", metavar="SECONDS", parser=seconds(0.0, LONGEST), help="Show the tree as it was at this time."),
]
TickOption = Annotated[
    int | None, typer.Option("--tick", metavar="N", parser=whole(0), help="Show the tree as it was after this tick.")
]
StepOption = Annotated[bool, typer.Option("--step", help="Show the tree after each tick; Enter continues, q ends.")]


def replay(
    file: RecordingArgument,
    at: AtOption = None,
    tick: TickOption = None,
    step: StepOption = False,
    as_json: JsonOption = False,
) -> None:
    """Show again what a mission did: every change, one tick after the other, or the tree at a time."""
    from regraft.services.bt_executor.observing.recording import Unreadable, steps

    if (at is not None) + (tick is not None) + step > 1:
        raise BadInput("--at, --tick and --step exclude each other: give one of them")
    try:
        recorded = steps(file)
        if at is not None or tick is not None:
            _show_one(_last(recorded, at, tick), as_json)
        elif step:
            _show_each(recorded)
        else:
            _show_changes(recorded, as_json)
    except Unreadable as error:
        raise BadInput(str(error)) from None


def _last(recorded: Iterable[Step], at: float | None, tick: int | None) -> Step:
    """Return the last step until a time, or that of a tick; of several runs with this tick, the last one's."""
    found, first, last = None, None, None
    for step in recorded:
        first, last = first or step, step
        if (at is not None and step.stamp <= at) or (tick is not None and step.tick == tick):
            found = step
    assert first is not None
    assert last is not None
    if found is None and at is not None:
        raise BadInput(f"--at {at:g}: the recording begins at {first.stamp:g} s and ends at {last.stamp:g} s")
    if found is None:
        raise BadInput(f"--tick {tick}: there is no such tick: the last one is {last.tick}")
    return found


def _show_one(step: Step, as_json: bool) -> None:
    if as_json:
        keys = ("uid", "parent", "name", "type", "path")
        nodes = [{key: getattr(node, key) for key in keys} | {"status": node.status.value} for node in step.nodes]
        show_json({**_plain(step), "nodes": nodes})
    else:
        _show_tree(step)


def _show_tree(step: Step) -> None:
    missed = f", {step.missed} changes missed" if step.missed else ""
    say(f"{step.tree} at {step.stamp:g} s, tick {step.tick}{missed}")
    for line in tree_lines(step.nodes):
        say(line)


def _show_each(recorded: Iterable[Step]) -> None:
    for step in recorded:
        for line in _changes(step):
            say(line)
        _show_tree(step)
        try:
            answer = input()
        except EOFError:
            return
        if answer.strip().lower() == QUIT:
            return


def _show_changes(recorded: Iterable[Step], as_json: bool) -> None:
    for step in recorded:
        if as_json:
            show_json(_plain(step), compact=True)
            continue
        if not step.tick:
            say(f"{step.stamp:9.2f} s  {step.tree}, {len(step.nodes)} nodes")
        for line in _changes(step):
            say(line)


def _plain(step: Step) -> dict[str, Any]:
    changes = [
        {
            "path": step.nodes[change.uid - 1].path,
            "before": change.before.value,
            "after": change.after.value,
            "stamp": change.stamp,
        }
        for change in step.changes
    ]
    return {"tree": step.tree, "tick": step.tick, "stamp": step.stamp, "missed": step.missed, "changes": changes}


def _changes(step: Step) -> Iterable[str]:
    for change in step.changes:
        node: MissionNode = step.nodes[change.uid - 1]
        what = f"{change.before.value} -> {change.after.value}"
        yield f"{change.stamp:9.2f} s  tick {step.tick}  {named(node)}: {what}"
    if step.missed:
        yield f"{step.stamp:9.2f} s  tick {step.tick}  {step.missed} changes missed"
