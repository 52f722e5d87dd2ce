"""The figures of evaluation B."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from regraft.evaluation.reports.figures import COLOURS, Draw
from regraft.evaluation.reports.sections import Arms
from regraft.evaluation.rows import TIME, Rows
from regraft.evaluation.study import Measure, RunRecord
from regraft.stacks.frog.studies import rounds_measures as measures
from regraft.stacks.frog.studies.rounds_recorder import REQUIREMENTS

SMOOTHED_OVER = 15
"""s over which the share of satisfied runs is averaged."""


def figures(arms: Arms) -> dict[str, Draw]:
    """Return what draws each figure, by file name."""
    found: dict[str, Draw] = {}
    scenarios: dict[str, list[str]] = {}
    for key, runs in arms.runs.items():
        scenarios.setdefault(runs[0].configuration.scenario, []).append(key)
    for scenario, keys in scenarios.items():
        suffix = f"_{scenario}" if scenario else ""
        corrected = (("U_vis, corrected", measures.visiting_utility), ("U_det, corrected", measures.detecting_utility))
        published = (
            ("U_vis, as published", measures.published_visiting_utility),
            ("U_det, as published", measures.published_detecting_utility),
        )
        shown = corrected if scenario else (*published, *corrected)
        found[f"utilities{suffix}.png"] = partial(_utilities, arms, keys, shown)
        found[f"satisfaction{suffix}.png"] = partial(_satisfaction, arms, keys)
        for key in keys:
            first = arms.runs[key][0]
            found[f"run_{key.replace('.', '_')}.png"] = partial(_timeline, first)
    return found


def _utilities(arms: Arms, keys: Sequence[str], shown: Sequence[tuple[str, Measure]], plot: Any) -> Any:
    figure, axes = plot.subplots(
        len(shown),
        1,
        figsize=(1.1 + 1.15 * len(keys), 2.6 * len(shown)),
        sharex=True,
        layout="constrained",
        squeeze=False,
    )
    for (title, measure), ax in zip(shown, axes[:, 0], strict=True):
        samples = [arms.values(key, measure) for key in keys]
        ax.boxplot(samples, widths=0.5, showfliers=False, medianprops={"color": "black"})
        for index, sample in enumerate(samples):
            spread = np.random.default_rng(index).uniform(-0.14, 0.14, len(sample))
            ax.plot(index + 1 + spread, sample, "o", markersize=3, alpha=0.6, color=COLOURS[index % len(COLOURS)])
        ax.set_ylabel(title)
        ax.set_ylim(bottom=0.0)
        ax.grid(axis="y", linewidth=0.4, alpha=0.6)
    axes[-1, 0].set_xticks(range(1, len(keys) + 1), [arms.name(key) for key in keys], rotation=20)
    return figure


def _satisfaction(arms: Arms, keys: Sequence[str], plot: Any) -> Any:
    figure, axes = plot.subplots(
        len(REQUIREMENTS), 1, figsize=(9, 1.7 * len(REQUIREMENTS)), sharex=True, sharey=True, layout="constrained"
    )
    for requirement, ax in zip(REQUIREMENTS, axes, strict=True):
        for index, key in enumerate(keys):
            times, share = satisfied_over_time([run.rows for run in arms.runs[key]], requirement)
            ax.plot(times, share, linewidth=1.2, color=COLOURS[index % len(COLOURS)], label=arms.name(key))
        ax.set_title(requirement, loc="left", fontsize=9)
        ax.set_ylim(-0.05, 1.05)
        ax.grid(linewidth=0.4, alpha=0.6)
    axes[0].legend(ncols=5, fontsize=7, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    axes[-1].set_xlabel(f"simulated time (s); share of the runs, mean over {SMOOTHED_OVER} s")
    return figure


def satisfied_over_time(runs: Sequence[Rows], requirement: str) -> tuple[list[float], list[float]]:
    """Return the times (s), and the share of the runs with a satisfied requirement among those with a known one.

    The share is a mean over the seconds around; it is NaN where nothing was known.
    """
    length = min((len(rows) for rows in runs), default=0)
    if not length:
        return [], []
    values = np.asarray([rows.number(requirement)[:length] for rows in runs])
    known, satisfied = np.isfinite(values).sum(axis=0), np.nansum(values, axis=0)
    window = np.ones(min(SMOOTHED_OVER, length))
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.convolve(satisfied, window, "same") / np.convolve(known, window, "same")
    return runs[0].number(TIME)[:length], share.tolist()


def _timeline(run: RunRecord, plot: Any) -> Any:
    rows = run.rows
    times = np.asarray(rows.number(TIME))
    figure, (upper, middle, lower) = plot.subplots(
        3, 1, figsize=(10, 6), sharex=True, height_ratios=(len(REQUIREMENTS), 3, 2), layout="constrained"
    )
    for row, name in enumerate(REQUIREMENTS):
        values = np.asarray(rows.number(name))
        for wanted, colour in ((1.0, "#4c9f70"), (0.0, "#d1495b")):
            bars = [(time - 1.0, 1.0) for time in times[values == wanted]]
            upper.broken_barh(bars, (row - 0.4, 0.8), color=colour)
    upper.set_yticks(range(len(REQUIREMENTS)), REQUIREMENTS)
    upper.invert_yaxis()
    upper.set_title(f"{run.configuration.key}, seed {run.seed}: green satisfied, red violated", loc="left", fontsize=9)
    middle.step(times, rows.number("max_velocity"), where="post", color=COLOURS[0], label="maximum")
    middle.plot(times, rows.number("speed"), color=COLOURS[5], linewidth=0.8, label="speed")
    middle.set_ylabel("m/s")
    middle.set_ylim(0.0, 0.3)
    middle.legend(fontsize=7, frameon=False, ncols=2, loc="upper right")
    near = middle.twinx()
    near.plot(times, rows.number("nearest"), color=COLOURS[3], linewidth=0.8)
    near.axhline(0.458, color=COLOURS[3], linewidth=0.6, linestyle="--")
    near.set_ylabel("nearest (m)", color=COLOURS[3])
    lower.plot(times, rows.number("darkness"), color=COLOURS[3], linewidth=1.0, label="darkness")
    corner = [float(topic != measures.OWN_TOPIC) for topic in rows.text("image_topic")]
    lower.fill_between(times, corner, step="post", alpha=0.2, color=COLOURS[4], label="corner camera")
    lower.step(
        times, np.asarray(rows.number("pictures_asked")) / 3.0, where="post", color=COLOURS[1], label="pictures / 3"
    )
    lower.set_ylim(-0.03, 1.08)
    lower.legend(fontsize=7, frameon=False, ncols=3, loc="upper right")
    lower.set_xlabel("simulated time (s)")
    lower.set_xlim(0.0, float(times[-1]) if len(times) else 1.0)
    return figure
