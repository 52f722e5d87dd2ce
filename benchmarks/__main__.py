"""``python -m benchmarks``: measure all budgets, or those named, and print one table."""

from __future__ import annotations

import json
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from benchmarks import choices, metacontrol, round_trip, start_up, tree_tick
from benchmarks.adapting import adaptations, move, restart, rewire, set_parameter, swap
from benchmarks.harness import Effort, Result, machine
from benchmarks.robots import devices, frog, many, memory, neighbours, qualities
from benchmarks.table import table

FILE_WIDTH = 170
"""Columns of the table where it does not go to a terminal."""
ALL: dict[str, Callable[[Effort], list[Result]]] = {
    "round_trip": round_trip.small,
    "large_messages": round_trip.large,
    "set_parameter": set_parameter.set_parameter,
    "adaptations": adaptations.adaptations,
    "rewire": rewire.rewire,
    "swap": swap.swap,
    "move": move.move,
    "restart": restart.restart,
    "start_up": start_up.start_up,
    "tree_tick": tree_tick.tree_tick,
    "choices": choices.choices,
    "reasoning": metacontrol.reasoning,
    "checking": metacontrol.checking,
    "devices": devices.devices,
    "frog": frog.frog,
    "many": many.many,
    "memory": memory.memory,
    "qualities": qualities.qualities,
    "neighbours": neighbours.neighbours,
}


def main(
    names: Annotated[list[str] | None, typer.Argument(help=f"Of: {', '.join(ALL)}. All by default.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the figures to this file too.")] = None,
    rounds: Annotated[int, typer.Option(min=1, help="How often each side is measured, in turns.")] = 5,
    share: Annotated[float, typer.Option(min=0.001, help="Scale every count; 1 is the default effort.")] = 1.0,
) -> None:
    """Measure every budget side by side with its baseline. Exits with 1 if a benchmark fails, not if one is slow."""
    console = Console(width=None if sys.stdout.isatty() else FILE_WIDTH)
    unknown = [name for name in names or [] if name not in ALL]
    if unknown:
        raise typer.BadParameter(f"no benchmark {', '.join(unknown)}; there are: {', '.join(ALL)}")
    results: dict[str, list[Result]] = {}
    failed: list[str] = []
    before = machine()
    for name in names or ALL:
        begun = time.monotonic()
        try:
            results[name] = ALL[name](Effort(rounds, share))
        except Exception:
            failed.append(name)
            console.print(f"{name} failed:\n{traceback.format_exc()}", markup=False)
        console.print(f"{name}: {time.monotonic() - begun:.0f} s", style="dim")
    console.print(table([result for found in results.values() for result in found]))
    console.print(f"before: {before}\nafter:  {machine()}", style="dim", markup=False, highlight=False)
    if json_file:
        lines = [
            {"benchmark": name, **asdict(result), "within": result.within}
            for name, found in results.items()
            for result in found
        ]
        figures = {"machine": {"before": before, "after": machine()}, "results": lines, "failed": failed}
        json_file.write_text(json.dumps(figures, indent=2) + "\n")
    if failed:
        raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
