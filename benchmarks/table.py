"""All results in one table."""

from __future__ import annotations

from rich.table import Table

from benchmarks.harness import Result

VERDICTS = {True: "[green]yes[/green]", False: "[red]no[/red]", None: ""}


def table(results: list[Result]) -> Table:
    """Return name, figure, baseline, ratio, least to greatest, budget, and whether it is kept."""
    shown = Table(box=None, pad_edge=False)
    for heading in ("what", "figure", "baseline", "ratio", "min … max", "budget", "within?", "how"):
        wide = heading in ("what", "how")
        shown.add_column(heading, justify="left" if wide else "right", no_wrap=heading != "how")
    for result in results:
        shown.add_row(
            result.name,
            f"{_short(result.figure)} {result.unit}",
            "" if result.baseline is None else f"{_short(result.baseline)} {result.unit}",
            "" if result.ratio is None else _short(result.ratio),
            "" if result.spread is None else " … ".join(map(_short, result.spread)),
            "" if result.limit is None else f"{'≥' if result.at_least else '≤'} {_short(result.limit)}",
            VERDICTS[result.within],
            ", against ".join(part for part in (result.note, result.against) if part),
        )
    return shown


def _short(number: float) -> str:
    return f"{number:.3g}" if abs(number) < 1000 else f"{number:.0f}"
