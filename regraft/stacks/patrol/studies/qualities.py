"""Which qualities each realization really has: it drives alone, with nothing going wrong but people on their way."""

from __future__ import annotations

import math
from typing import Any, Final

from regraft.evaluation.reports.markdown import table
from regraft.evaluation.reports.sections import Arms, arms_of, costs_line, head, measures_table
from regraft.evaluation.rows import Rows
from regraft.evaluation.statistics.samples import summary
from regraft.evaluation.study import Changes, Configuration, Measure, Report, Results, Study, joined, variant
from regraft.stacks.patrol.studies.managers import FOLDER, RECORDED
from regraft.stacks.patrol.studies.patrol_measures import places, worst_error

SECONDS: Final = 150.0
PUBLISHED: Final[dict[str, tuple[float, float, float]]] = {
    "normal": (0.8, 0.7, 0.5),
    "performance": (0.55, 0.9, 0.7),
    "slow": (0.7, 0.4, 0.3),
    "energy_saving": (0.6, 0.3, 0.34),
    "degraded": (0.55, 0.2, 0.45),
    "degraded_energy_save": (0.6, 0.1, 0.34),
}
"""Safety, performance and energy as published with MROS2's patrol."""


def _mean(name: str) -> Measure:
    def measure(rows: Rows) -> float:
        known = [value for value in rows.number(name) if not math.isnan(value)]
        return sum(known) / len(known) if known else math.nan

    return measure


QUALITIES: Final[dict[str, Measure]] = {name: _mean(name) for name in ("safety", "performance", "energy")}
COLUMNS: Final[dict[str, Measure]] = {**QUALITIES, "places": places, "worst error at a place (m)": worst_error}


def alone(realization: str) -> Changes:
    """Return what keeps a realization in force from the beginning on."""
    rule = {"when": "not map_server.failed", "mode": f"to_navigate.{realization}", "because": "it is measured"}
    planner = "regraft.adaptation_manager.planners.modes.mode_planner:ModePlanner"
    return {"components": {"mode_planner": {"class": planner}}, "rules": {"alone": rule}}


def report(results: Results) -> Report:
    """Return the measured qualities, next to the published ones."""
    arms = arms_of(results)
    parts = [head("Qualities of the realizations, driving alone", results)]
    if not arms.runs:
        return Report("\n".join([*parts, "No run is finished.\n"]))
    text = "Mean over a run, then over the runs; after the slash as published.\n"
    return Report(
        "\n".join(
            [*parts, text, _beside(arms), "## All measures\n", measures_table(arms, COLUMNS), costs_line(results)]
        )
    )


def _beside(arms: Arms) -> str:
    rows = []
    for key in arms.runs:
        published = PUBLISHED[arms.name(key)]
        cells = [
            f"{summary(arms.values(key, measure)).mean:.2f} / {known:g}"
            for measure, known in zip(QUALITIES.values(), published, strict=True)
        ]
        rows.append([key, *cells])
    return table(["realization", *QUALITIES], rows)


def _configuration(realization: str) -> Configuration:
    differences: dict[str, Any] = joined(variant(FOLDER / "none.yaml"), alone(realization))

    def changes(seed: int) -> Changes:
        return differences

    return Configuration(realization, f"the realization {realization} all the time", changes)


STUDY = Study(
    "patrol-qualities",
    "Which qualities do the realizations of a patrol really have?",
    RECORDED,
    {"measured": tuple(_configuration(name) for name in PUBLISHED)},
    report,
    seconds=SECONDS,
    runs=10,
    measures={"measured": COLUMNS},
)
