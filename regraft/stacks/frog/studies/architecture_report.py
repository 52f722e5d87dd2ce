"""The report of evaluation B: the published table and tests next to ours, or those of the corrected definitions."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from regraft.evaluation.reports.figures import illustrated
from regraft.evaluation.reports.markdown import UNKNOWN, mean_and_sd, number, p_value, table
from regraft.evaluation.reports.sections import (
    Arms,
    Claim,
    adaptations_table,
    arms_of,
    comparisons_table,
    costs_line,
    head,
    intervals_table,
    measures_table,
)
from regraft.evaluation.rows import Rows
from regraft.evaluation.statistics.samples import summary
from regraft.evaluation.study import Report, Results
from regraft.stacks.frog.studies import rounds_measures as measures
from regraft.stacks.frog.studies.architecture_figures import figures
from regraft.stacks.frog.studies.arms.columns import AS_PUBLISHED, CORRECTED, SENSITIVITY
from regraft.stacks.frog.studies.published_results import PUBLISHED, PUBLISHED_P
from regraft.stacks.frog.studies.reactions_table import reactions_table
from regraft.stacks.frog.studies.rounds_recorder import REQUIREMENTS
from regraft.stacks.frog.utility import SLOW, is_near

BASELINE = "baseline"


def report(results: Results) -> Report:
    """Return the report of the results so far."""
    arms = arms_of(results)
    parts = [head("FROG: does adapting the architecture pay?", results)]
    body = _published(arms) if results.definitions == "published" else _corrected(arms)
    parts += body if arms.runs else ["No run is finished.\n"]
    if arms.runs:
        parts += [_satisfaction(arms), _adaptation(arms, results)]
    pictures, shown = illustrated(figures(arms))
    return Report("\n".join([*parts, *shown]), pictures)


# --- published ---


def _published(arms: Arms) -> list[str]:
    rows = []
    for key in arms.runs:
        rows.append([f"{key}, here", *(_mean_and_sd(arms.values(key, each)) for each in AS_PUBLISHED.values())])
        known = PUBLISHED.get(key, {})
        rows.append([f"{key}, published", *(mean_and_sd(*known[name]) if known else UNKNOWN for name in AS_PUBLISHED)])
    claims = [Claim(name, key, BASELINE) for name in ("U_vis", "U_det") for key in arms.runs if key != BASELINE]
    text = [Claim("U_vis, text", BASELINE, key) for key in arms.runs if key != BASELINE]
    shown = [
        [claim.measure, f"{claim.greater} > {claim.less}", p_value(PUBLISHED_P[claim.greater, claim.measure])]
        for claim in claims
        if (claim.greater, claim.measure) in PUBLISHED_P
    ]
    return [
        "## Table I, by the published formulas\n",
        table(["", *AS_PUBLISHED], rows),
        "*Published* figures are recomputed from the published rows, with columns labelled by what they are.\n",
        "## Tests\n",
        comparisons_table(arms, claims, AS_PUBLISHED, 0.001),
        "Published, uncorrected:\n",
        table(["measure", "claim", "p"], shown),
        "With MoveSafely as the paper's text has it, nothing near OR a maximum below 0.18 m/s, the other way round:\n",
        comparisons_table(arms, text, AS_PUBLISHED, 0.001),
        "## The same runs by the corrected measures\n",
        measures_table(arms, CORRECTED),
        intervals_table(arms, {name: AS_PUBLISHED[name] for name in ("U_vis", "U_det")}),
    ]


# --- corrected ---


def _corrected(arms: Arms) -> list[str]:
    parts = ["## Utilities\n"]
    for scenario, keys in scenarios(arms).items():
        parts += [f"### {scenario}\n", measures_table(arms, CORRECTED, keys)]
    return [
        *parts,
        "## Sensitivity\n",
        measures_table(arms, SENSITIVITY),
        "## Intervals\n",
        intervals_table(arms, {name: CORRECTED[name] for name in ("U_vis", "U_det")}),
        "## Why: what a second of driving is worth\n",
        _why(arms),
    ]


def scenarios(arms: Arms) -> dict[str, list[str]]:
    """Return the configurations' keys by scenario."""
    found: dict[str, list[str]] = {}
    for key, runs in arms.runs.items():
        found.setdefault(runs[0].configuration.scenario, []).append(key)
    return found


def _why(arms: Arms) -> str:
    rows = []
    for key, runs in arms.runs.items():
        drives = [drive for run in runs for drive in measures.drives_of(run.rows)]
        cells = []
        for near in (False, True):
            own = [drive for drive in drives if is_near(drive.nearest) is near]
            slow = sum(drive.max_velocity < SLOW for drive in own)
            speed = sum(drive.speed for drive in own) / len(own) if own else float("nan")
            share = f"{slow / len(own):.0%}" if own else UNKNOWN
            cells += [f"{len(own) / len(drives):.0%}" if drives else UNKNOWN, share, number(speed)]
        rows.append([key, *cells])
    headings = ["far", "maximum < 0.18", "mean speed", "near", "maximum < 0.18", "mean speed"]
    return table(["configuration", *headings], rows)


# --- both ---


def _satisfaction(arms: Arms) -> str:
    rows = [[key, *(_mean_and_sd(arms.values(key, _share_of(name))) for name in REQUIREMENTS)] for key in arms.runs]
    text = "Share of the seconds for which it was known, while its task ran, by the requirement's own definition.\n"
    return f"## Requirements satisfied\n\n{text}\n{table(['configuration', *REQUIREMENTS], rows)}"


def _share_of(requirement: str) -> Callable[[Rows], float]:
    def share(rows: Rows) -> float:
        known = [value for value in rows.number(requirement) if value == value]
        return sum(known) / len(known) if known else float("nan")

    return share


def _adaptation(arms: Arms, results: Results) -> str:
    cost = "An adaptation takes no simulated time; what it takes on the wall clock is this machine's.\n"
    return "\n".join(
        [
            "## Adaptations\n",
            cost,
            adaptations_table(arms),
            "## Reactions\n",
            reactions_table(arms),
            "## Cost of the runs\n",
            costs_line(results),
        ]
    )


def _mean_and_sd(values: Sequence[float]) -> str:
    found = summary(values)
    return mean_and_sd(found.mean, found.sd)
