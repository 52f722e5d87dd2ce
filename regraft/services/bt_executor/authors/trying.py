"""``regraft mission dry-run``: what a tree does with mocks in place of the nodes that act."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from regraft.cli.outcomes import FAILED
from regraft.cli.terminal.numbers import seconds
from regraft.cli.terminal.options import JsonOption
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.cli.terminal.values import assignments
from regraft.services.bt_executor.authors.options import MainOption, NodesOption, StackOption, TreeFile, TreesOption

if TYPE_CHECKING:
    from regraft.services.bt_executor.authors.dry_run import DryRun, NodeRun

MAX_SECONDS = 1e6
MocksOption = Annotated[
    Path | None,
    typer.Option("--mocks", metavar="FILE.json", help="Rules with TestNodeConfigs and SubstitutionRules."),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Write an entry of the blackboard first; may be repeated."),
]
ForOption = Annotated[
    float,
    typer.Option(
        "--for", metavar="SECONDS", parser=seconds(0.0, MAX_SECONDS), help="The longest time, by the tree's clock."
    ),
]


def dry_run(
    file: TreeFile,
    mocks: MocksOption = None,
    main: MainOption = "",
    nodes: NodesOption = None,
    stack: StackOption = None,
    trees: TreesOption = None,
    entries: SetOption = None,
    longest: ForOption = 600.0,
    as_json: JsonOption = False,
) -> None:
    """Run a tree without a system: nodes that act are mocked; report which nodes were reached, and their results.

    The exit code is 1 unless the tree succeeds.
    """
    from regraft.services.bt_executor.authors import dry_run as running
    from regraft.services.bt_executor.authors.known_types import known_to_authors, library_known

    given = assignments(entries or [], "--set ")
    doubts: list[str] = []
    known = known_to_authors(nodes or [], stack, file, doubts)
    library = library_known(trees, stack)
    done = running.dry_run(file, known, mocks=mocks, main=main, library=library, entries=given, seconds=longest)
    if as_json:
        show_json(asdict(done))
    else:
        for doubt in (*doubts, *done.warnings):
            complain(f"warning: {doubt}")
        for pattern in done.unused_rules:
            complain(f"warning: the rule '{pattern}' puts nothing in any node's place")
        _show(done)
    if done.result != "SUCCESS":
        raise typer.Exit(FAILED)


def _show(done: DryRun) -> None:
    error = f": {done.error}" if done.error else ""
    say(f"{done.tree}: {done.result} after {done.ticks} ticks, {done.seconds:g} s{error}")
    say(f"{done.reached} of {len(done.nodes)} nodes reached ({done.coverage:.0%})")
    headings = ("node", "ticks", "running", "success", "failure", "skipped", "")
    show_table(headings, map(_row, done.nodes), empty="no nodes")


def _row(node: NodeRun) -> tuple[object, ...]:
    name = node.name if node.name == node.type else f"{node.name} ({node.type})"
    counts = (node.ticks, node.running, node.successes, node.failures, node.skips)
    notes = [*(["mocked"] if node.mocked else []), *([] if node.ticks else ["not reached"])]
    return (f"{'  ' * node.depth}{name}", *(count or "" for count in counts), ", ".join(notes))
