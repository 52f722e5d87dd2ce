"""FROG's search in many rooms: one after the other at full speed, a table, and whether the promises are kept.

``python -m regraft.evaluation.search_campaign --seeds 1-20 --out DIR`` writes ``search.md`` and ``search.json`` and
exits with 1 if a promise is broken.
"""

from __future__ import annotations

import argparse
import json
import math
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from regraft.bus_schema.encoding import codec
from regraft.cli.system.closing import DIGITS_SHOWN
from regraft.evaluation.runs.folder_lock import InUse, held
from regraft.evaluation.runs.search_run import SearchRun, run_search
from regraft.evaluation.runs.stack_run import RunFailed
from regraft.stack.installed import stack_file

STACK = Path("frog/search.yaml")
AT_LEAST, AT_MOST = 305.0, 900.0
"""s of simulated time that a run takes: the localization is judged at 300 s."""
IOU, POSE_ERROR, TARGET_ERROR, CHARGES = 0.9, 0.10, 0.3, 2
SHARE = 0.9
"""Of the rooms in which each promise must be kept."""


@dataclass(frozen=True, slots=True)
class Promise:
    """A claim that must hold in so large a share of the rooms."""

    text: str
    holds: Callable[[SearchRun], bool]
    share: float = SHARE


def _iou(run: SearchRun) -> float:
    judged = run.judgement
    return min(judged.occupied_iou or 0.0, judged.free_iou or 0.0)


def _within(value: float | None, limit: float) -> bool:
    return value is not None and value <= limit


PROMISES = (
    Promise(
        f"room mapped (IoU at least {IOU:g}, pose error at most {POSE_ERROR:g} m), all goals visited, no contact",
        lambda run: (
            _iou(run) >= IOU
            and _within(run.judgement.pose_error, POSE_ERROR)
            and not run.judgement.missed
            and bool(run.judgement.visited)
            and run.judgement.contacts == 0
        ),
    ),
    Promise(
        f"hydrant located within {TARGET_ERROR:g} m", lambda run: _within(run.judgement.target_error, TARGET_ERROR)
    ),
    Promise(
        f"at least {CHARGES} charging visits while exploring",
        lambda run: run.judgement.charges.get("exploring", 0) >= CHARGES,
    ),
    Promise("battery never empty", lambda run: run.judgement.lowest_charge > 0.0, share=1.0),
    Promise("no part lost", lambda run: bool(run.closing.get("reproducible")), share=1.0),
)


def report(runs: Sequence[SearchRun], failures: dict[int, str]) -> str:
    """Return the table by seed and what became of the promises, as Markdown."""
    total = len(runs) + len(failures)
    lines = [
        "| seed | mission | s | IoU occupied | IoU free | pose error m | odometry alone m | worst m | visited "
        "| contacts | hydrant error m | charges exploring, visiting | lowest charge | x real time | digest, ticks |",
        "|---" * 15 + "|",
        *(_row(run) for run in runs),
        *(f"| {seed} | {why} |" + " |" * 13 for seed, why in failures.items()),
        "",
    ]
    for promise in PROMISES:
        kept, needed = sum(promise.holds(run) for run in runs), math.ceil(promise.share * total)
        lines.append(f"- {promise.text}: {kept} of {total} ({'kept' if kept >= needed else f'BROKEN, needs {needed}'})")
    return "\n".join(lines) + "\n"


def _row(run: SearchRun) -> str:
    judged = run.judgement
    cells = [
        str(run.seed),
        judged.mission,
        _number(judged.ended, 0),
        _number(judged.occupied_iou, 3),
        _number(judged.free_iou, 3),
        _number(judged.pose_error, 3),
        _number(judged.odometry_error, 3),
        _number(judged.worst_pose_error, 3),
        f"{len(judged.visited)} of {len(judged.visited) + len(judged.missed)}",
        str(judged.contacts),
        _number(judged.target_error, 3),
        f"{judged.charges.get('exploring', 0)}, {judged.charges.get('visiting', 0)}",
        f"{judged.lowest_charge:.0%}",
        _number(run.closing.get("real_time_factor"), 1),
        _digest(run),
    ]
    return f"| {' | '.join(cells)} |"


def _digest(run: SearchRun) -> str:
    digest = run.closing.get("digest")
    return f"`{digest[:DIGITS_SHOWN]}`, {run.closing.get('ticks')}" if digest else "-"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def is_kept(runs: Sequence[SearchRun], failures: dict[int, str]) -> bool:
    """Return whether all promises are kept; a run that failed keeps none."""
    total = len(runs) + len(failures)
    return all(sum(promise.holds(run) for run in runs) >= math.ceil(promise.share * total) for promise in PROMISES)


def seeds_of(text: str) -> list[int]:
    """Return the seeds in a text such as ``1-5,8``; raises ValueError."""
    found: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        found += range(int(first), int(last or first) + 1)
    return found


def run_campaign(
    stack: Path, seeds: Sequence[int], out: Path, options: tuple[str, ...], at_most: float
) -> tuple[list[SearchRun], dict[int, str]]:
    """Run every seed, reporting progress, and write the report after each; returns the runs and the failures."""
    runs: list[SearchRun] = []
    failures: dict[int, str] = {}
    out.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        try:
            run = run_search(
                stack, seed, out / f"seed_{seed}", at_least=min(AT_LEAST, at_most), at_most=at_most, options=options
            )
        except (RunFailed, OSError) as error:
            failures[seed] = str(error)
            sys.stdout.write(f"seed {seed}: {error}\n")
        else:
            runs.append(run)
            sys.stdout.write(_row(run) + "\n")
            _write_events(out / f"seed_{seed}" / "events.txt", run)
        sys.stdout.flush()
        (out / "search.md").write_text(report(runs, failures))
        found = [{"seed": each.seed, **codec.to_plain(each.judgement), "closing": each.closing} for each in runs]
        (out / "search.json").write_text(json.dumps(found, indent=1))
    return runs, failures


def _write_events(path: Path, run: SearchRun) -> None:
    path.write_text("".join(f"{each.stamp:9.2f} {each.kind:28} {each.subject}: {each.text}\n" for each in run.events))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the campaign; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m regraft.evaluation.search_campaign", description=__doc__)
    parser.add_argument("--seeds", default="1-20", help="such as 1-5,8")
    parser.add_argument("--out", type=Path, required=True, help="folder for the report and the runs' files")
    parser.add_argument("--stack", type=Path, default=STACK, help="the stack file")
    parser.add_argument("--for", type=float, default=AT_MOST, dest="at_most", help="simulated seconds at the most")
    parser.add_argument("--set", action="append", default=[], dest="overrides", metavar="COMPONENT.PARAMETER=VALUE")
    chosen = parser.parse_args(arguments)
    # The end of the campaign, by a signal too, ends the run that is under way.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    options = tuple(part for override in chosen.overrides for part in ("--set", override))
    stack, out = stack_file(chosen.stack), chosen.out.resolve()
    try:
        with held(out):
            runs, failures = run_campaign(stack, seeds_of(chosen.seeds), out, options, chosen.at_most)
    except InUse as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write("\n" + report(runs, failures))
    return 0 if is_kept(runs, failures) else 1


if __name__ == "__main__":
    sys.exit(main())
