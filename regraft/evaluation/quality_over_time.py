"""How well requirements are met over time, and what is adapted for their sake: tables and a picture of runs.

``python -m regraft.evaluation.quality_over_time --stack STACK --mission TREE.xml --for 300 --out DIR`` runs the mission
at full speed. It writes ``quality.md``, ``TREE.jsonl`` (all reports, one document a line) and, with matplotlib,
``TREE.png``. With ``--mission`` several times they run one after the other, and the table has a column for each.
"""

from __future__ import annotations

import argparse
import importlib
import json
import signal
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from pathlib import Path
from typing import IO, Any

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome
from regraft.evaluation.runs.quality_run import QualityRun, run_mission
from regraft.evaluation.runs.stack_run import RunFailed
from regraft.stack.installed import stack_file


class Standing(Enum):
    """The state of a requirement while its task runs; where it does not run, a requirement has none."""

    SATISFIED = "satisfied"
    VIOLATED = "violated"
    UNKNOWN = "unknown"


COLOURS = {Standing.SATISFIED: "#4c9f70", Standing.VIOLATED: "#d1495b", Standing.UNKNOWN: "#d9d9d9"}


@dataclass(frozen=True, slots=True)
class Spell:
    """From ``start`` to ``end`` (s) a requirement had this state."""

    start: float
    end: float
    standing: Standing

    @property
    def seconds(self) -> float:
        """How long it lasted."""
        return self.end - self.start


def spells(qualities: Iterable[Quality], until: float) -> dict[str, list[Spell]]:
    """Return by requirement, in the tree's order, the states of each until a time (s).

    A report holds until the next one; spells of no length are left out, and equal neighbours are one.
    """
    told: dict[str, list[Quality]] = {}
    for quality in sorted(qualities, key=_place):
        told.setdefault(quality.requirement, []).append(quality)
    return {name: _joined(own, until) for name, own in told.items()}


def _place(quality: Quality) -> tuple[int, str]:
    """Return what sorts requirements as the tree has them: the number at the end of their paths, if they have one."""
    number = quality.node.rpartition("::")[2]
    return (int(number) if number.isdecimal() else 0, quality.requirement)


def _joined(own: Sequence[Quality], until: float) -> list[Spell]:
    found: list[Spell] = []
    ends = [later.stamp for _, later in pairwise(own)] + [until]
    for quality, end in zip(own, ends, strict=True):
        standing = standing_of(quality)
        if standing is None or end <= quality.stamp:
            continue
        if found and found[-1].standing is standing and found[-1].end == quality.stamp:
            found[-1] = Spell(found[-1].start, end, standing)
        else:
            found.append(Spell(quality.stamp, end, standing))
    return found


def standing_of(quality: Quality) -> Standing | None:
    """Return the state of a requirement; None while its task does not run."""
    if not quality.active:
        return None
    if quality.satisfied is None:
        return Standing.UNKNOWN
    return Standing.SATISFIED if quality.satisfied else Standing.VIOLATED


def satisfied_share(own: Sequence[Spell]) -> float | None:
    """Return the share of the time for which it was known that the requirement was satisfied; None if it never was."""
    known = sum(spell.seconds for spell in own if spell.standing is not Standing.UNKNOWN)
    satisfied = sum(spell.seconds for spell in own if spell.standing is Standing.SATISFIED)
    return satisfied / known if known else None


def report(runs: Sequence[QualityRun]) -> str:
    """Return a table with a column for each run, as Markdown."""
    found = [spells(run.qualities, run.seconds) for run in runs]
    names = list(dict.fromkeys(name for each in found for name in each))
    lines = [f"| | {' | '.join(run.mission for run in runs)} |", "|---" * (1 + len(runs)) + "|"]
    for name in names:
        cells = [_share(each.get(name, [])) for each in found]
        lines.append(f"| {name} satisfied | {' | '.join(cells)} |")
    for counted in ("visits", "pictures", "hits"):
        counts = [_counts(run.closing.get(counted, {})) for run in runs]
        lines.append(f"| {counted} | {' | '.join(counts)} |")
    lines.append(f"| adaptations | {' | '.join(_outcomes(run.adaptations) for run in runs)} |")
    distances = [f"{run.closing.get('distance', 0.0):.1f}" for run in runs]
    lines.append(f"| distance m | {' | '.join(distances)} |")
    lines.append(f"| contacts | {' | '.join(str(run.closing.get('contacts', '-')) for run in runs)} |")
    return "\n".join(lines) + "\n"


def _share(own: Sequence[Spell]) -> str:
    share = satisfied_share(own)
    known = sum(spell.seconds for spell in own if spell.standing is not Standing.UNKNOWN)
    return "-" if share is None else f"{share:.0%} of {known:.0f} s"


def _counts(counts: dict[str, int]) -> str:
    total = sum(counts.values())
    parts = ", ".join(f"{name} {count}" for name, count in counts.items())
    return f"{total} ({parts})" if len(counts) > 1 else parts or "0"


def _outcomes(reports: Iterable[AdaptationReport]) -> str:
    counts: dict[str, int] = {}
    for each in reports:
        counts[each.outcome.value] = counts.get(each.outcome.value, 0) + 1
    return ", ".join(f"{count} {outcome}" for outcome, count in counts.items()) or "0"


def write_record(path: Path, run: QualityRun) -> None:
    """Write all reports as JSON, one document a line, each with its ``kind``."""
    with path.open("w") as file:
        for kind, messages in (("quality", run.qualities), ("adaptation", run.adaptations), ("event", run.events)):
            for message in messages:
                _write(file, kind, told=codec.to_plain(message))
        for kind, values in (("darkness", run.darkness), ("max_velocity", run.speed), ("camera", run.camera)):
            for stamp, value in values:
                _write(file, kind, stamp=stamp, value=value)
        _write(file, "closing", told=run.closing)


def _write(file: IO[str], kind: str, **what: Any) -> None:
    file.write(json.dumps({"kind": kind, **what}) + "\n")


def draw(pyplot: Any, run: QualityRun, path: Path) -> None:
    """Draw requirements as bands, the maximum velocity with the darkness, and the camera in use, over time."""
    found = spells(run.qualities, run.seconds)
    figure, (upper, middle, lower) = pyplot.subplots(
        3, 1, figsize=(11, 6.5), sharex=True, height_ratios=(len(found) or 1, 3, 1), layout="constrained"
    )
    for row, own in enumerate(found.values()):
        for standing, colour in COLOURS.items():
            bars = [(spell.start, spell.seconds) for spell in own if spell.standing is standing]
            upper.broken_barh(bars, (row - 0.4, 0.8), color=colour, label=standing.value if row == 0 else None)
    upper.set_yticks(range(len(found)), list(found))
    upper.invert_yaxis()
    upper.set_title(f"{run.mission}: requirements while their tasks run", loc="left")
    upper.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
    _draw_speed(middle, run)
    _draw_camera(lower, run)
    lower.set_xlim(0.0, run.seconds)
    lower.set_xlabel("simulated time (s)")
    figure.savefig(path, dpi=120)
    pyplot.close(figure)


def _draw_speed(axes: Any, run: QualityRun) -> None:
    steps = [*run.speed, (run.seconds, run.speed[-1][1])] if run.speed else []
    axes.step([at for at, _ in steps], [value for _, value in steps], where="post", color="#1f4e79")
    applied = [each.started for each in run.adaptations if each.outcome is Outcome.APPLIED]
    axes.plot(applied, [0.0] * len(applied), "|", color="black", markersize=9, label="adaptation")
    axes.set_ylabel("max. velocity (m/s)", color="#1f4e79")
    axes.set_ylim(-0.01, 0.3)
    axes.legend(loc="lower right", frameon=False)
    darkness = axes.twinx()
    darkness.plot([at for at, _ in run.darkness], [value for _, value in run.darkness], color="#8a6d1d", linewidth=1.0)
    darkness.set_ylabel("darkness", color="#8a6d1d")
    darkness.set_ylim(-0.03, 1.03)


def _draw_camera(axes: Any, run: QualityRun) -> None:
    topics = list(dict.fromkeys(topic for _, topic in run.camera))
    ends = [at for at, _ in run.camera[1:]] + [run.seconds]
    for (start, topic), end in zip(run.camera, ends, strict=True):
        axes.broken_barh([(start, end - start)], (topics.index(topic) - 0.4, 0.8), color="#7a7a7a")
    axes.set_yticks(range(len(topics)), topics)
    axes.set_ylim(len(topics) - 0.4, -0.6)


def _pyplot() -> Any:
    try:
        matplotlib = importlib.import_module("matplotlib")
        matplotlib.use("Agg")
        return importlib.import_module("matplotlib.pyplot")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError("no picture: it needs matplotlib ('pip install matplotlib')") from error


def write_report(runs: Sequence[QualityRun], out: Path) -> None:
    """Write the table, the records, and the pictures if matplotlib is there, into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "quality.md").write_text(report(runs))
    for run in runs:
        write_record(out / f"{run.mission}.jsonl", run)
    try:
        pyplot = _pyplot()
    except ModuleNotFoundError as error:
        sys.stderr.write(f"{error}\n")
        return
    for run in runs:
        draw(pyplot, run, out / f"{run.mission}.png")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the missions and write the report; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m regraft.evaluation.quality_over_time", description=__doc__)
    parser.add_argument("--stack", type=Path, required=True, help="the stack file")
    parser.add_argument(
        "--mission", type=Path, action="append", required=True, help="a tree's file; several: all of them"
    )
    parser.add_argument("--for", type=float, default=300.0, dest="seconds", help="simulated seconds")
    parser.add_argument("--seed", type=int, default=1, help="which room")
    parser.add_argument("--out", type=Path, required=True, help="folder for the report and the runs' files")
    parser.add_argument("--set", action="append", default=[], dest="overrides", metavar="COMPONENT.PARAMETER=VALUE")
    chosen = parser.parse_args(arguments)
    names = [mission.stem for mission in chosen.mission]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        parser.error(f"two missions are named {twice!r}: each has a record of its own name, so rename one of them")
    # The end of this process, by a signal too, ends the run that is under way.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    options = tuple(part for override in chosen.overrides for part in ("--set", override))
    out: Path = chosen.out.resolve()
    runs = []
    for mission in chosen.mission:
        try:
            runs.append(
                run_mission(stack_file(chosen.stack), mission, chosen.seed, chosen.seconds, out / mission.stem, options)
            )
        except (RunFailed, OSError) as error:
            sys.stderr.write(f"{mission}: {error}\n")
            return 1
    write_report(runs, out)
    sys.stdout.write(report(runs))
    return 0


if __name__ == "__main__":
    sys.exit(main())
