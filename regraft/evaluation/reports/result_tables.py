"""Tables of a report that are made of a table of results alone: measures by arm, verdicts, and what was run."""

from __future__ import annotations

from collections.abc import Sequence

from regraft.evaluation.claims.judging import Judged, did_the_same, same_by
from regraft.evaluation.reports.markdown import UNKNOWN, mean_and_sd, number, p_value, table
from regraft.evaluation.results.table import ResultRow, ResultTable
from regraft.evaluation.statistics.paired import Direction
from regraft.evaluation.statistics.samples import summary

MOST_SPANS = 10
"""Ranges of seeds that are shown one by one."""
SIGNS = {Direction.GREATER: ">", Direction.LESS: "<", Direction.EQUAL: "="}


def measures_of(results: ResultTable, scenario: str, measures: Sequence[str]) -> str:
    """Return mean and standard deviation of measures, a row for each arm; arms that did the same share one."""
    rows = []
    for group in did_the_same(results, scenario):
        runs = results.of(scenario, group[0])
        cells = [_mean_and_sd(results, scenario, group[0], measure) for measure in measures]
        rows.append([", ".join(f"`{arm}`" for arm in group), str(len(runs)), *cells])
    return table(["arm", "runs", *measures], rows)


def _mean_and_sd(results: ResultTable, scenario: str, arm: str, measure: str) -> str:
    found = summary(list(results.values(scenario, arm, measure).values()))
    missing = len(results.of(scenario, arm)) - found.size
    return mean_and_sd(found.mean, found.sd) + (f" (of {found.size})" if missing else "")


def rows_of(results: ResultTable, scenario: str, measures: Sequence[str]) -> str:
    """Return measures of each run, a row for each arm and seed."""
    arms = results.arms(scenario)
    rows = []
    for arm in arms:
        for row in results.of(scenario, arm).values():
            cells = [number(row.measures[measure]) for measure in measures]
            rows.append([*([f"`{arm}`"] if len(arms) > 1 else []), str(row.seed), *cells])
    return table([*(["arm"] if len(arms) > 1 else []), "seed", *measures], rows)


def verdicts_of(judged: Sequence[Judged]) -> str:
    """Return each claim with its effect and verdict."""
    rows = []
    for each in judged:
        claim = each.claim
        stated = f"{claim.measure}: `{claim.first}` {SIGNS[claim.direction]} `{claim.second}`"
        verdict = f"**{each.verdict.value}**" + (f", as {each.same_as}" if each.same_as else "")
        family = f"{claim.family} ({sum(other.claim.family == claim.family for other in judged)})"
        rows.append([claim.name, family, stated, *_effect_cells(each), number(claim.smallest_effect), verdict])
    headings = ["claim", "family (of)", "", "first", "second", "difference as claimed (interval)", "as claimed in"]
    headings += ["p, Holm", "worth having", "verdict"]
    return table(headings, rows)


def _effect_cells(judged: Judged) -> list[str]:
    found = judged.effect
    if found is None:
        return [UNKNOWN] * 5
    equal = f", {found.equal} equal" if found.equal else ""
    return [
        number(found.first),
        number(found.second),
        f"{number(found.difference)} ({number(found.low)} to {number(found.high)}, {judged.confidence:.1%})",
        f"{found.won} of {found.runs}{equal}",
        p_value(judged.p),
    ]


def same_of(results: ResultTable, scenario: str, measures: Sequence[str]) -> str:
    """Return which arms did the same, as lines: in everything, and in what a measure is made of."""
    lines = [
        f"- {_names(group)} did the same in every run." for group in did_the_same(results, scenario) if len(group) > 1
    ]
    for measure in measures:
        groups = [group for group in same_by(results, scenario, measure) if len(group) > 1]
        lines += [f"- {_names(group)} have the same {measure} in every run." for group in groups]
    return "\n".join(lines or ["No two arms did the same."]) + "\n"


def _names(group: Sequence[str]) -> str:
    return f"{', '.join(f'`{arm}`' for arm in group[:-1])} and `{group[-1]}`"


def runs_of(results: ResultTable) -> str:
    """Return what was run: how many runs of how many seeds for each use, with which code on what."""
    rows = []
    for use in dict.fromkeys(row.use for row in results.rows):
        runs = [row for row in results.rows if row.use == use]
        arms = len({row.configuration for row in runs})
        lengths = ", ".join(dict.fromkeys(f"{row.seconds:g} s" for row in runs))
        rows.append([use or "none", str(len(runs)), str(arms), _seeds(runs), lengths, *_made_with(runs)])
    return table(["seeds", "runs", "arms", "which", "length", "code", "renderer", "versions"], rows)


def _made_with(runs: Sequence[ResultRow]) -> list[str]:
    return [
        ", ".join(dict.fromkeys(f"`{row.code[:12]}`" for row in runs)),
        ", ".join(dict.fromkeys(row.renderer for row in runs if row.renderer)) or UNKNOWN,
        "; ".join(f"`{versions}`" for versions in dict.fromkeys(row.versions for row in runs)),
    ]


def _seeds(runs: Sequence[ResultRow]) -> str:
    """Return the seeds, those that follow each other as ranges.

    A list of many that do not is shortened.
    """
    seeds = sorted({row.seed for row in runs})
    spans: list[list[int]] = []
    for seed in seeds:
        if spans and seed == spans[-1][1] + 1:
            spans[-1][1] = seed
        else:
            spans.append([seed, seed])
    shown = [str(first) if first == last else f"{first} to {last}" for first, last in spans]
    return ", ".join(shown if len(shown) <= MOST_SPANS else [*shown[:3], f"… ({len(seeds)} seeds)"])
