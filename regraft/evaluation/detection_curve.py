"""How often a detector sees what is there, by darkness and by distance: tables and a plot.

``python -m regraft.evaluation.detection_curve --looks LOOKS.csv --out DIR`` reads looks whose truth is known and writes
``detection_curve.md``, ``detection_curve.csv`` and, with matplotlib, ``detection_curve.png``.
"""

from __future__ import annotations

import argparse
import csv
import importlib
import math
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import Any

DARKNESS = tuple(n / 10 for n in range(11))
"""Edges of the bins of darkness: 0 is full light, 1 is black."""
DISTANCES = (0.4, 0.6, 0.8, 1.0, 1.3, 1.7, 2.2, 3.0)
"""Edges of the bins of distance (m)."""
LIT = 0.3
"""Darkness below which the table by distance is made."""


@dataclass(frozen=True, slots=True)
class Look:
    """One picture that one detector looked at.

    ``distance`` (m) is infinite if the object was not in view; ``error`` (m) is how far from its true place the best
    sighting is, NaN without a sighting; ``hit`` means that it was seen where it is, ``false_alarm`` that anything was
    seen where it is not.
    """

    detector: str
    renderer: str
    darkness: float
    distance: float
    hit: bool
    false_alarm: bool
    error: float
    confidence: float

    @property
    def in_view(self) -> bool:
        """Whether there was something to see."""
        return math.isfinite(self.distance)


@dataclass(frozen=True, slots=True)
class Bin:
    """The hit rate over the looks of one bin; NaN without any."""

    low: float
    high: float
    looks: int
    rate: float


def bins(looks: Iterable[Look], value: Callable[[Look], float], edges: Sequence[float]) -> list[Bin]:
    """Return hit rates by a value of the looks in which the object was in view; the last bin has its upper edge."""
    seen = [look for look in looks if look.in_view]
    found = []
    for low, high in pairwise(edges):
        inside = [x for x in seen if low <= value(x) < high or value(x) == high == edges[-1]]
        rate = sum(look.hit for look in inside) / len(inside) if inside else math.nan
        found.append(Bin(low, high, len(inside), rate))
    return found


def by_darkness(looks: Iterable[Look]) -> list[Bin]:
    """Return hit rates by tenths of darkness."""
    return bins(looks, lambda look: look.darkness, DARKNESS)


def by_distance(looks: Iterable[Look], darker_than: float = 0.0, lighter_than: float = LIT) -> list[Bin]:
    """Return hit rates by distance within a range of darkness, by default in good light."""
    chosen = [look for look in looks if darker_than <= look.darkness < lighter_than]
    return bins(chosen, lambda look: look.distance, DISTANCES)


def false_alarms(looks: Iterable[Look]) -> float:
    """Return the share of pictures without the object in which something was taken for it; NaN without any."""
    empty = [look for look in looks if not look.in_view]
    return sum(look.false_alarm for look in empty) / len(empty) if empty else math.nan


def percentile_error(looks: Iterable[Look], share: float) -> float:
    """Return the error (m) of position that a share of the hits stays within; NaN without hits."""
    errors = sorted(look.error for look in looks if look.hit)
    return errors[min(len(errors) - 1, math.floor(share * len(errors)))] if errors else math.nan


def groups(looks: Iterable[Look]) -> dict[tuple[str, str], list[Look]]:
    """Return the looks by detector and renderer, sorted."""
    grouped: dict[tuple[str, str], list[Look]] = {}
    for look in looks:
        grouped.setdefault((look.detector, look.renderer), []).append(look)
    return dict(sorted(grouped.items()))


def report(looks: Iterable[Look]) -> str:
    """Return the tables as Markdown."""
    parts = groups(looks)
    lines = ["# Detection by light and distance", "", "Hit rate with the hydrant in view, by darkness.", ""]
    lines += _table(parts, by_darkness, "darkness")
    lines += ["", f"Hit rate by distance (m), darkness below {LIT}.", "", *_table(parts, by_distance, "distance")]
    lines += ["", "| detector | renderer | pictures | false alarms | wrong place | error 50 % (m) | 95 % (m) |"]
    lines += ["|---|---|---|---|---|---|---|"]
    for (detector, renderer), own in parts.items():
        seen = [look for look in own if look.in_view]
        wrong = sum(look.false_alarm for look in seen) / len(seen) if seen else math.nan
        errors = f"{percentile_error(own, 0.5):.3f} | {percentile_error(own, 0.95):.3f}"
        lines.append(f"| {detector} | {renderer} | {len(own)} | {false_alarms(own):.2%} | {wrong:.2%} | {errors} |")
    return "\n".join(lines) + "\n"


def _table(parts: dict[tuple[str, str], list[Look]], binned: Callable[[list[Look]], list[Bin]], name: str) -> list[str]:
    columns = {key: binned(own) for key, own in parts.items()}
    titles = " | ".join(f"{detector}, {renderer}" for detector, renderer in columns)
    lines = [f"| {name} | {titles} |", "|---" * (1 + len(columns)) + "|"]
    for rows in zip(*columns.values(), strict=True):
        cells = " | ".join(f"{one.rate:.2f} ({one.looks})" for one in rows)
        lines.append(f"| {rows[0].low:.1f} to {rows[0].high:.1f} | {cells} |")
    return lines


def write_looks(path: Path, looks: Iterable[Look]) -> None:
    """Write looks as CSV, one a line."""
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Look)])
        writer.writeheader()
        for look in looks:
            writer.writerow({**asdict(look), "hit": int(look.hit), "false_alarm": int(look.false_alarm)})


def read_looks(path: Path) -> list[Look]:
    """Read looks from CSV.

    Raises:
        ValueError: a line is no look; the error names it.
    """
    looks = []
    with path.open(newline="") as file:
        for number, row in enumerate(csv.DictReader(file), start=2):
            try:
                darkness, distance, error, confidence = (
                    float(row[name]) for name in ("darkness", "distance", "error", "confidence")
                )
                hit, false_alarm = (bool(int(row[name])) for name in ("hit", "false_alarm"))
                looks.append(
                    Look(row["detector"], row["renderer"], darkness, distance, hit, false_alarm, error, confidence)
                )
            except (KeyError, TypeError, ValueError) as problem:
                raise ValueError(f"{path}, line {number}: not a look ({type(problem).__name__}: {problem})") from None
    return looks


def write_report(looks: Sequence[Look], out: Path) -> None:
    """Write the tables, the looks, and the plot if matplotlib is there, into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "detection_curve.md").write_text(report(looks))
    write_looks(out / "detection_curve.csv", looks)
    try:
        pyplot = _pyplot()
    except ModuleNotFoundError as error:
        sys.stderr.write(f"{error}\n")
    else:
        _plot(pyplot, looks, out / "detection_curve.png")


def _pyplot() -> Any:
    try:
        matplotlib = importlib.import_module("matplotlib")
        matplotlib.use("Agg")
        return importlib.import_module("matplotlib.pyplot")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError("no plot: it needs matplotlib ('pip install matplotlib')") from error


def _plot(pyplot: Any, looks: Sequence[Look], path: Path) -> None:
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(11, 4), sharey=True)
    for (detector, renderer), own in groups(looks).items():
        for axes, found in ((left, by_darkness(own)), (right, by_distance(own))):
            middles = [(one.low + one.high) / 2 for one in found]
            axes.plot(middles, [one.rate for one in found], marker="o", label=f"{detector}, {renderer}")
    left.set_xlabel("darkness")
    right.set_xlabel(f"distance (m), darkness below {LIT}")
    left.set_ylabel("hit rate, hydrant in view")
    left.set_ylim(-0.03, 1.03)
    left.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make the report of the looks in a file."""
    parser = argparse.ArgumentParser(prog="python -m regraft.evaluation.detection_curve", description=__doc__)
    parser.add_argument("--looks", type=Path, required=True, help="CSV file of looks whose truth is known")
    parser.add_argument("--out", type=Path, required=True, help="folder for the report")
    chosen = parser.parse_args(arguments)
    write_report(read_looks(chosen.looks), chosen.out)


if __name__ == "__main__":
    main()
