"""``regraft evaluate``: runs studies, writes their reports, and checks what is published of them."""

from __future__ import annotations

import shlex
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from typer.core import TyperGroup

from regraft.bus_schema.suggestions import instead_of
from regraft.cli.outcomes import FAILED, BadInput, Failed
from regraft.cli.terminal.numbers import seconds as parse_seconds
from regraft.cli.terminal.numbers import whole
from regraft.cli.terminal.output import complain, say
from regraft.evaluation.campaign import BadCampaign, Campaign, CodeChanged, NoRoom, Progress, Wanted, write_files
from regraft.evaluation.claims.model import SeedSet
from regraft.evaluation.finding import NoSuchStudy, find_study
from regraft.evaluation.publishing.commands import (
    chosen_definitions,
    claims,
    claims_if_written,
    claims_of,
    fill_tables,
    join_results,
    results_and_verdicts,
    verify_results,
)
from regraft.evaluation.results.table import table_text
from regraft.evaluation.runs.run_directory import BadRun
from regraft.evaluation.study import Configuration, Study
from regraft.process.trial.trial_import import check_imports
from regraft.stack.classes import look_in

REPORT, RESULTS = "report.md", "results.csv"


class Studies(TyperGroup):
    """The commands about studies: ``regraft evaluate STUDY`` is short for ``regraft evaluate run STUDY``."""

    default: Final = "run"

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take anything but a command or a request for help as a study to run."""
        if args and args[0] not in self.commands and args[0] not in ctx.help_option_names:
            args = [self.default, *args]
        return super().parse_args(ctx, args)


evaluate = typer.Typer(
    cls=Studies,
    help="Run studies; 'regraft evaluate STUDY' is short for 'regraft evaluate run STUDY'.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
evaluate.command("claims")(claims)
evaluate.command("verify")(verify_results)
evaluate.command("join")(join_results)
evaluate.command("tables")(fill_tables)


@evaluate.command(Studies.default)
def run(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="A study's name, or MODULE:NAME.")],
    runs: Annotated[
        int | None, typer.Option("--runs", metavar="N", parser=whole(1, 10_000), help="Runs of each configuration.")
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option("--seed", metavar="N", parser=whole(0), help="The first run's seed; others have the next."),
    ] = None,
    seeds: Annotated[
        SeedSet | None, typer.Option("--seeds", metavar="USE", help="Those of the study's claims for this use.")
    ] = None,
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
    look_in(Path.cwd())
    check_imports([study.partition(":")[0]] if ":" in study else [], complain)
    try:
        found = find_study(study)
        chosen = chosen_definitions(found, definitions)
        which = _which_runs(found, chosen, runs, seed, seeds, one_seed)
        written = claims_if_written(found, chosen)  # a mistake in them is found before hours of runs
        wanted = _wanted(found, chosen, configurations, seconds, which)
        folder = (out or Path(f"{found.name}-{wanted.definitions}")).resolve()
        campaign = Campaign(wanted, folder, parallel)
        with campaign.opened(resume=resume, report_only=report_only):
            if not report_only:
                with_progress(campaign)
            results = campaign.results(_command(sys.argv[1:]))
            report = found.report(results)
            table, verdicts = results_and_verdicts(found, results, written)
            files = [*sorted(report.files.items()), (RESULTS, table_text(table).encode())]
            markdown = "\n\n".join(part.strip() for part in (report.markdown, verdicts, campaign.provenance()) if part)
            write_files(folder, [*files, (REPORT, f"{markdown}\n".encode())])
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


@dataclass(frozen=True, slots=True)
class _Runs:
    """The runs of each configuration: so many from a seed on, or with ``seeds`` one each."""

    count: int
    seed: int
    seeds: tuple[int, ...] = ()
    one_seed: bool = False


def _which_runs(
    study: Study, definitions: str, runs: int | None, seed: int | None, use: SeedSet | None, one_seed: bool
) -> _Runs:
    if use is None:
        return _Runs(runs or study.runs, 1 if seed is None else seed, one_seed=one_seed)
    if seed is not None or one_seed:
        raise BadInput("--seeds takes the seeds of the study's claims: leave out --seed and --one-seed")
    known = claims_of(study, definitions).seeds[use]
    if not known:
        raise BadInput(f"the claims of {study.name} have no {use.value} seeds")
    if runs is not None and use is SeedSet.CONFIRMATION:
        raise BadInput("--runs: the confirmation takes all its seeds, once: leave it out")
    if runs is not None and runs > len(known):
        raise BadInput(f"--runs: is {runs}, but there are {len(known)} {use.value} seeds")
    chosen = known[: runs or len(known)]
    return _Runs(len(chosen), chosen[0], chosen)


def _wanted(study: Study, definitions: str, configurations: str, seconds: float | None, runs: _Runs) -> Wanted:
    known = study.configurations[definitions]
    picked = _picked(known, [part.strip() for part in configurations.split(",")])
    length = seconds or study.seconds
    return Wanted(study, definitions, picked, runs.count, runs.seed, length, runs.one_seed, runs.seeds)


def _picked(known: Sequence[Configuration], patterns: Sequence[str]) -> tuple[Configuration, ...]:
    for pattern in patterns:
        if not any(fnmatchcase(each.key, pattern) for each in known):
            raise BadInput(f"there is no configuration {pattern!r}; {instead_of(pattern, [c.key for c in known])}")
    return tuple(each for each in known if any(fnmatchcase(each.key, pattern) for pattern in patterns))


def _command(arguments: Sequence[str]) -> str:
    return f"regraft {shlex.join(arguments)}"
