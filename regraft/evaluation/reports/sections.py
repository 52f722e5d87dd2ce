"""Sections that every report has: measures by configuration, comparisons, what was adapted and what it cost."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from regraft.bus_schema.model.adaptation import Outcome
from regraft.evaluation.reports.markdown import UNKNOWN, mean_and_sd, number, p_value, table
from regraft.evaluation.statistics.samples import LEAST_RUNS, compare, holm, interval, summary
from regraft.evaluation.study import Measure, Results, RunRecord


@dataclass(frozen=True, slots=True)
class Arms:
    """The finished runs by configuration key, in the order of the configurations."""

    runs: Mapping[str, Sequence[RunRecord]]

    def name(self, key: str) -> str:
        """Return the name of a configuration, without its scenario."""
        return self.runs[key][0].configuration.name

    def values(self, key: str, measure: Measure) -> list[float]:
        """Return a measure of each run that has one."""
        return list(self.by_seed(key, measure).values())

    def by_seed(self, key: str, measure: Measure) -> dict[tuple[int, int], float]:
        """Return a measure of each run that has one, by its seed and, for several of one seed, its number."""
        found = {(run.seed, run.number): measure(run.rows) for run in self.runs.get(key, ())}
        return {place: value for place, value in found.items() if math.isfinite(value)}


def arms_of(results: Results) -> Arms:
    """Return the runs of results by configuration."""
    found: dict[str, list[RunRecord]] = {}
    for run in results.runs:
        found.setdefault(run.configuration.key, []).append(run)
    return Arms(found)


def head(title: str, results: Results) -> str:
    """Return the title, how many runs there are, by which command, and what failed."""
    seeds = sorted({run.seed for run in results.runs})
    shown = f"{seeds[0]} to {seeds[-1]}" if len(seeds) > 1 else ", ".join(map(str, seeds)) or UNKNOWN
    seconds = sorted({run.seconds for run in results.runs})
    lengths = ", ".join(f"{each:g} s" for each in seconds) or UNKNOWN
    made = f"{len(results.runs)} of {results.planned} runs"
    lines = [
        f"# {title}",
        "",
        f"{made} of {lengths}; seeds {shown}; *{results.definitions}* definitions.",
        "",
        f"`{results.command}`",
    ]
    if results.failures:
        lines += ["", f"**{len(results.failures)} runs failed** and are in no table:", ""]
        lines += [f"- {each.configuration.key}, seed {each.seed}: {each.why}" for each in results.failures]
    missing = results.planned - len(results.runs) - len(results.failures)
    if missing:
        lines += ["", f"**{missing} runs are still to be made**: the tables are of those that there are."]
    return "\n".join(lines) + "\n"


def measures_table(arms: Arms, measures: Mapping[str, Measure], keys: Sequence[str] | None = None) -> str:
    """Return mean and standard deviation of each measure, a row for each configuration."""
    rows = [
        [key, str(len(arms.runs[key])), *(_mean_and_sd(arms.values(key, measure)) for measure in measures.values())]
        for key in (arms.runs if keys is None else keys)
    ]
    return table(["configuration", "runs", *measures], rows)


def _mean_and_sd(values: Sequence[float]) -> str:
    found = summary(values)
    return mean_and_sd(found.mean, found.sd)


def intervals_table(arms: Arms, measures: Mapping[str, Measure]) -> str:
    """Return each measure's mean with its 95 % bootstrap interval, median, and Shapiro-Wilk's p."""
    rows = []
    for name, measure in measures.items():
        for key in arms.runs:
            values = arms.values(key, measure)
            found, (low, high) = summary(values), interval(values)
            inside = f"{number(low)} to {number(high)}"
            rows.append([name, key, number(found.mean), inside, number(found.median), p_value(found.normal_p)])
    return table(["measure", "configuration", "mean", "95 %", "median", "normal: p"], rows)


@dataclass(frozen=True, slots=True)
class Claim:
    """That one configuration has more of a measure than another."""

    measure: str
    greater: str
    less: str


def comparisons_table(arms: Arms, claims: Sequence[Claim], measures: Mapping[str, Measure], alpha: float) -> str:
    """Return Mann and Whitney's one-sided test of each claim, corrected for their number, and the effect's size.

    It also has in how many of the pairs of equal seeds the claim holds: seeds may differ more than configurations.
    """
    samples = {
        claim: (arms.values(claim.greater, measures[claim.measure]), arms.values(claim.less, measures[claim.measure]))
        for claim in claims
    }
    found = {claim: compare(*pair) for claim, pair in samples.items() if min(map(len, pair)) >= LEAST_RUNS}
    by_name = {f"{index}": comparison.p for index, comparison in enumerate(found.values())}
    corrected = list(holm(by_name).values())
    rows = []
    for (claim, each), p in zip(found.items(), corrected, strict=True):
        effect = f"{each.a12:.3f} ({each.a12_low:.3f} to {each.a12_high:.3f})"
        difference = f"{number(each.difference)} ({number(each.difference_low)} to {number(each.difference_high)})"
        verdict = "yes" if p < alpha else "no"
        told = [
            number(each.u, 4),
            p_value(each.p),
            p_value(p),
            verdict,
            effect,
            f"{each.rank_biserial:+.3f}",
            difference,
            _with_equal_seeds(arms, claim, measures[claim.measure]),
        ]
        rows.append([claim.measure, f"{claim.greater} > {claim.less}", *told])
    if not rows:
        return f"No two configurations have {LEAST_RUNS} runs each: nothing is compared.\n"
    headings = ["measure", "claim", "U", "p", "p, Holm", f"p < {alpha:g}", "A12 (95 %)", "rank-biserial"]
    return table([*headings, "difference of means (95 %)", "holds with equal seeds"], rows)


def _with_equal_seeds(arms: Arms, claim: Claim, measure: Measure) -> str:
    greater, less = arms.by_seed(claim.greater, measure), arms.by_seed(claim.less, measure)
    pairs = [(greater[place], less[place]) for place in greater.keys() & less.keys()]
    equal = sum(one == other for one, other in pairs)
    text = f"{sum(one > other for one, other in pairs)} of {len(pairs)}"
    return f"{text}, {equal} equal" if equal else text


def adaptations_table(arms: Arms) -> str:
    """Return how much was adapted in a run, and what it cost on the wall clock."""
    rows = []
    for key, runs in arms.runs.items():
        outcomes: dict[str, int] = {}
        for report in (each for run in runs for each in run.adaptations):
            outcomes[report.outcome.value] = outcomes.get(report.outcome.value, 0) + 1
        applied = summary([_applied(run) for run in runs])
        spent = [1000.0 * seconds for run in runs for seconds in run.timing.adaptations]
        cost = f"{np.median(spent):.0f}, {np.quantile(spent, 0.95):.0f}" if spent else UNKNOWN
        per_run = summary([sum(run.timing.adaptations) for run in runs]).mean
        others = ", ".join(f"{count} {name}" for name, count in outcomes.items() if name != Outcome.APPLIED.value)
        rows.append([key, mean_and_sd(applied.mean, applied.sd), others or "none", cost, number(per_run, 2)])
    return table(["configuration", "applied in a run", "others, in all", "ms each: median, 95 %", "s a run"], rows)


def _applied(run: RunRecord) -> float:
    return float(sum(report.outcome is Outcome.APPLIED for report in run.adaptations))


def _simulated(run: RunRecord) -> float:
    """Return how long (s) a run lasted: a recorder may have ended it before its length."""
    return float(run.closing.get("simulated_s") or run.seconds)


def costs_line(results: Results) -> str:
    """Return what the runs cost on the wall clock."""
    startup = summary([run.timing.startup for run in results.runs])
    factor = summary([_simulated(run) / run.timing.running for run in results.runs if run.timing.running > 0.0])
    slowest = max((run.timing.startup for run in results.runs), default=math.nan)
    return (
        f"Start-up took {number(startup.mean, 2)} s on average, {number(slowest, 2)} s at the most; "
        f"runs went {number(factor.mean, 2)} times as fast as real time.\n"
    )
