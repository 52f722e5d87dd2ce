"""The figures of the patrol's managers: where the first robot of each drove, and how its run went."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from regraft.evaluation.reports.figures import COLOURS, Draw
from regraft.evaluation.reports.sections import Arms
from regraft.evaluation.rows import TIME, Rows
from regraft.evaluation.study import RunRecord
from regraft.stacks.patrol.studies.patrol_measures import (
    CAMERA,
    CROWD,
    LASER,
    LOW,
    NO_MODE,
    REST,
    SAFE,
    THRIFTY,
    realizations,
)
from regraft.stacks.patrol.studies.patrol_recorder import ranges_of

Floats = NDArray[np.float64]
DESIGNS: Final = ("performance", "normal", "slow", "energy_saving", "degraded", "degraded_energy_save", NO_MODE, REST)
"""The realizations from the fastest to the slowest, then what was entered without a mode, and rest."""
SPELLS: Final = {"laser fails": LASER, "camera is black": CAMERA, "crowd": CROWD}


def figures(arms: Arms) -> dict[str, Draw]:
    """Return what draws each figure, by file name: a map and a run over time for each manager."""
    found: dict[str, Draw] = {}
    for key, runs in arms.runs.items():
        name = key.replace(".", "_")
        found[f"map_{name}.png"] = partial(_map, runs[0])
        found[f"run_{name}.png"] = partial(_timeline, runs[0])
    return found


def _colour(design: str) -> str:
    return COLOURS[DESIGNS.index(design)] if design in DESIGNS else COLOURS[-1]


def _title(run: RunRecord) -> str:
    return f"{run.configuration.key}, seed {run.seed}"


def _map(run: RunRecord, plot: Any) -> Any:
    rows = run.rows
    x, y = np.asarray(rows.number("x")), np.asarray(rows.number("y"))
    figure, ax = plot.subplots(figsize=(10, 5.2), layout="constrained")
    ax.plot(*_seen(rows), ",", color="#9a9a9a")
    designs = realizations(rows)
    for design in DESIGNS:
        here = np.asarray([each == design for each in designs])
        if here.any():
            ax.plot(x[here], y[here], ".", markersize=3, color=_colour(design), label=design)
    for name, where in _visits(rows).items():
        ax.plot(*where, "*", markersize=9, color="black")
        ax.annotate(name, where, (4, 4), textcoords="offset points", fontsize=7)
    ax.set_aspect("equal")
    ax.set_title(
        f"{_title(run)}: a dot a second, a star a place reached; grey is what stands or walks", loc="left", fontsize=9
    )
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")
    ax.legend(fontsize=7, frameon=False, ncols=2, loc="center")
    return figure


def _seen(rows: Rows) -> tuple[Floats, Floats]:
    """Return all points (x and y; m, map frame) that the true scans of a run hit."""
    known = [number for number, cell in enumerate(rows.text("true_ranges")) if cell]
    if not known:
        return np.empty(0), np.empty(0)
    around = np.asarray([ranges_of(rows.text("true_ranges")[number]) for number in known])
    around[np.isinf(around)] = np.nan
    x, y, yaw = (np.asarray(rows.number(name))[known][:, None] for name in ("x", "y", "yaw"))
    angles = yaw + np.linspace(0.0, 2.0 * np.pi, around.shape[1], endpoint=False)
    return (x + around * np.cos(angles)).ravel(), (y + around * np.sin(angles)).ravel()


def _visits(rows: Rows) -> dict[str, tuple[float, float]]:
    """Return where (m, map frame) the robot stood when it first reached each place."""
    found: dict[str, tuple[float, float]] = {}
    for name, x, y in zip(rows.text("last_place"), rows.number("x"), rows.number("y"), strict=True):
        if name:
            found.setdefault(name, (x, y))
    return found


def _timeline(run: RunRecord, plot: Any) -> Any:
    times = np.asarray(run.rows.number(TIME))
    figure, (spells, designs, qualities, charge) = plot.subplots(
        4, 1, figsize=(10, 7.5), sharex=True, height_ratios=(2, 3.5, 4, 2), layout="constrained"
    )
    _bars(spells, times, {text: run.rows.is_so(name) for text, name in SPELLS.items()}, ["#d1495b"] * len(SPELLS))
    spells.set_title(f"{_title(run)}: what goes wrong, the realization in force, qualities", loc="left", fontsize=9)
    chosen = realizations(run.rows)
    strips = {design: [each == design for each in chosen] for design in DESIGNS}
    _bars(designs, times, strips, [_colour(design) for design in DESIGNS])
    for index, name in enumerate(("safety", "performance", "energy")):
        qualities.plot(times, run.rows.number(name), linewidth=0.9, color=COLOURS[index], label=name)
    qualities.axhline(SAFE, color=COLOURS[0], linewidth=0.6, linestyle="--")
    qualities.axhline(THRIFTY, color=COLOURS[2], linewidth=0.6, linestyle="--")
    qualities.set_ylim(-0.03, 1.1)
    qualities.legend(fontsize=7, frameon=False, ncols=3, loc="upper right")
    charge.plot(times, run.rows.number("charge"), linewidth=1.0, color=COLOURS[3], label="charge")
    charge.axhline(LOW, color=COLOURS[3], linewidth=0.6, linestyle="--")
    charge.set_ylim(0.0, 1.05)
    charge.set_ylabel("charge")
    places = charge.twinx()
    places.step(times, run.rows.number("places"), where="post", linewidth=1.0, color=COLOURS[4])
    places.set_ylabel("places reached", color=COLOURS[4])
    charge.set_xlabel("simulated time (s)")
    charge.set_xlim(0.0, float(times[-1]) if len(times) else 1.0)
    return figure


def _bars(ax: Any, times: Any, strips: dict[str, list[bool]], colours: Sequence[str]) -> None:
    """Draw a strip for each name, filled in the seconds in which it holds."""
    for row, (lasts, colour) in enumerate(zip(strips.values(), colours, strict=True)):
        bars = [(time - 1.0, 1.0) for time in times[np.asarray(lasts, bool)]]
        ax.broken_barh(bars, (row - 0.4, 0.8), color=colour)
    ax.set_yticks(range(len(strips)), list(strips), fontsize=8)
    ax.set_ylim(len(strips) - 0.5, -0.5)
