"""``regraft evaluate``: runs a study and writes its report."""

from __future__ import annotations

import shlex
import signal
import sys
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import typer

from regraft.bus_schema.suggestions import instead_of
from regraft.cli.outcomes import FAILED, BadInput, Failed
from regraft.cli.terminal.numbers import seconds as parse_seconds
from regraft.cli.terminal.numbers import whole
from regraft.cli.terminal.output import complain, say
from regraft.evaluation.campaign import BadCampaign, Campaign, CodeChanged, NoRoom, Progress, Wanted, write_files
from regraft.evaluation.finding import NoSuchStudy, find_study
from regraft.evaluation.runs.run_directory import BadRun
from regraft.evaluation.study import Configuration, Study
from regraft.process.trial.trial_import import check_imports

REPORT = "report.md"


def evaluate(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="A study's name, or MODULE:NAME.")],
    runs: Annotated[
        int | None, typer.Option("--runs", metavar="N", parser=whole(1, 10_000), help="Runs of each configuration.")
    ] = None,
    seed: Annotated[
        int, typer.Option("--seed", metavar="N", parser=whole(0), help="The first run's seed; others have the next.")
    ] = 1,
    configurations: Annotated[
        str, typer.Option("--configurations", metavar="A,B", help="Only these; * stands for anything.")
    ] = "*",
    definitions: Annotated[
        str | None, typer.Option("--definitions", metavar="NAME", help="By which definitions, if there are several.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--for", metavar="SECONDS", parser=parse_seconds(1.0), help="Length of a run.")
    ] = None,
    parallel: Annotated[int, typer.Option("--parallel", metavar="N", parser=whole(1, 64), help="Runs at a time.")] = 1,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the campaign that is there.")] = False,
    one_seed: Annotated[
        bool, typer.Option("--one-seed", help="The same seed for all runs, which differ by timing only.")
    ] = False,
    report_only: Annotated[bool, typer.Option("--report-only", help="Run nothing: report what is there.")] = False,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Default: ./STUDY-DEFINITIONS.")] = None,
) -> None:
    """Run a study: many seeded runs of a system at full speed, then the report with its tables and figures.

    It can be ended at any time, and continued by --resume. Exits with 1 if a run failed.
    """
    # The end of the campaign, by a signal too, ends the runs that are under way.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    check_imports([study.partition(":")[0]] if ":" in study else [], complain)
    try:
        found = find_study(study)
        wanted = _wanted(found, definitions, configurations, runs, seed, seconds, one_seed)
        folder = (out or Path(f"{found.name}-{wanted.definitions}")).resolve()
        campaign = Campaign(wanted, folder, parallel)
        with campaign.opened(resume=resume, report_only=report_only):
            if not report_only:
                with_progress(campaign)
            results = campaign.results(_command(sys.argv[1:]))
            report = found.report(results)
            files = sorted(report.files.items())
            markdown = f"{report.markdown.rstrip()}\n\n{campaign.provenance()}"
            write_files(folder, [*files, (REPORT, markdown.encode())])
    except (NoSuchStudy, BadCampaign) as error:
        raise BadInput(str(error)) from None
    except (NoRoom, CodeChanged, BadRun) as error:
        raise Failed(str(error)) from None
    say(f"{len(results.runs)} of {results.planned} runs, {len(results.failures)} failed: {folder / REPORT}")
    if results.failures:
        raise typer.Exit(FAILED)


def with_progress(campaign: Campaign) -> None:
    """Run a campaign, showing how far it is: a line for each run, and one that changes on a terminal."""
    on_terminal = sys.stdout.isatty()
    shown = ""

    def tell(progress: Progress) -> None:
        nonlocal shown
        line = progress_line(progress)
        if on_terminal and line != shown:
            sys.stdout.write(f"\r\x1b[K{line}")
            sys.stdout.flush()
            shown = line

    def line(text: str) -> None:
        sys.stdout.write("\r\x1b[K" if on_terminal else "")
        say(f"{text}; {progress_line(campaign.progress())}")
        sys.stdout.flush()

    try:
        campaign.run(tell, line)
    finally:
        sys.stdout.write("\r\x1b[K" if on_terminal else "")


def progress_line(progress: Progress) -> str:
    """Return how far a campaign is, as one line.

    >>> progress_line(Progress(3, 1, 75, ("baseline/002 at 120 s",), 4000.0))
    '3 of 75 done, 1 failed; baseline/002 at 120 s; 67 min left'
    """
    parts = [f"{progress.done} of {progress.total} done" + (f", {progress.failed} failed" if progress.failed else "")]
    parts += [", ".join(progress.running)] if progress.running else []
    if progress.left is not None and (progress.running or progress.done + progress.failed < progress.total):
        parts.append(f"{progress.left / 60.0:.0f} min left" if progress.left > 90.0 else f"{progress.left:.0f} s left")
    return "; ".join(parts)


def _wanted(
    study: Study,
    definitions: str | None,
    configurations: str,
    runs: int | None,
    seed: int,
    seconds: float | None,
    one_seed: bool,
) -> Wanted:
    chosen = next(iter(study.configurations)) if definitions is None else definitions
    if chosen not in study.configurations:
        raise BadInput(f"{study.name} has no definitions {chosen!r}; {instead_of(chosen, study.configurations)}")
    known = study.configurations[chosen]
    picked = _picked(known, [part.strip() for part in configurations.split(",")])
    return Wanted(study, chosen, picked, runs or study.runs, seed, seconds or study.seconds, one_seed)


def _picked(known: Sequence[Configuration], patterns: Sequence[str]) -> tuple[Configuration, ...]:
    for pattern in patterns:
        if not any(fnmatchcase(each.key, pattern) for each in known):
            raise BadInput(f"there is no configuration {pattern!r}; {instead_of(pattern, [c.key for c in known])}")
    return tuple(each for each in known if any(fnmatchcase(each.key, pattern) for pattern in patterns))


def _command(arguments: Sequence[str]) -> str:
    return f"regraft {shlex.join(arguments)}"
