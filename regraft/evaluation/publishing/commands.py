"""``regraft evaluate claims|verify|join|tables``: claims of a study, its results, and the tables of pages."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from regraft.bus_schema.suggestions import instead_of
from regraft.cli.outcomes import FAILED, BadInput, Failed
from regraft.cli.terminal.numbers import whole
from regraft.cli.terminal.options import JsonOption
from regraft.cli.terminal.output import say, show_json
from regraft.evaluation.campaign import CodeChanged, NoRoom
from regraft.evaluation.claims.judging import judge
from regraft.evaluation.claims.model import Claim, Claims, SeedSet
from regraft.evaluation.claims.power import seeds_needed
from regraft.evaluation.claims.reading import read_claims
from regraft.evaluation.finding import NoSuchStudy, find_study
from regraft.evaluation.publishing.documents import BadPage, filled
from regraft.evaluation.publishing.verifying import sampled, verify
from regraft.evaluation.reports.result_tables import SIGNS, verdicts_of
from regraft.evaluation.results.joining import joined
from regraft.evaluation.results.recording import result_table
from regraft.evaluation.results.table import BadTable, ResultTable, read_table, table_text
from regraft.evaluation.runs.run_directory import BadRun
from regraft.evaluation.study import Results, Study
from regraft.stack.classes import look_in
from regraft.whole_files import write_whole


def claims_of(study: Study, definitions: str) -> Claims:
    """Return the claims of a study by some definitions.

    Raises:
        BadInput: it has none.
        StackError: something is wrong with them.
    """
    if definitions not in study.claims:
        raise BadInput(f"{study.name} has no claims by the definitions {definitions!r}: give its Study a file of them")
    return read_claims(study.claims[definitions], study)


def claims_if_written(study: Study, definitions: str) -> Claims | None:
    """Return the claims of a study by some definitions, None if it has none, or none yet.

    Raises:
        StackError: something is wrong with them.
    """
    if definitions not in study.claims:
        return None
    file = study.claims[definitions]
    if not file.exists():
        say(f"{file}: the study's claims are not written yet: seeds have no use, and there are no verdicts")
        return None
    return claims_of(study, definitions)


def chosen_definitions(study: Study, definitions: str | None) -> str:
    """Return the definitions that are asked for, the study's first if none are; raises BadInput."""
    chosen = next(iter(study.configurations)) if definitions is None else definitions
    if chosen not in study.configurations:
        raise BadInput(f"{study.name} has no definitions {chosen!r}; {instead_of(chosen, study.configurations)}")
    return chosen


def results_and_verdicts(study: Study, results: Results, claims: Claims | None) -> tuple[ResultTable, str]:
    """Return a campaign's table of results, and the verdicts on its claims as a part of its report."""
    several = len({run.seed for run in results.runs}) < len({(run.seed, run.number) for run in results.runs})

    def use_of(seed: int) -> str:
        use = claims.set_of(seed) if claims and not several else None
        return use.value if use else ""

    table = result_table(study, results, use_of)
    if claims is None:
        return table, ""
    uses = [use for use in (SeedSet.REPORTING, SeedSet.CONFIRMATION) if table.used_for(use.value).rows]
    parts = [f"\n## Verdicts by the {use.value} seeds\n\n{verdicts_of(judge(claims, table, use))}" for use in uses]
    return table, "".join(parts)


def claims(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="A study's name, or MODULE:NAME.")],
    definitions: Annotated[
        str | None, typer.Option("--definitions", metavar="NAME", help="By which definitions, if there are several.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Check and show what a study claims, and how many seeds each claim needs."""
    known = _study(study)
    found = claims_of(known, chosen_definitions(known, definitions))
    if as_json:
        show_json({"file": found.file, "claims": [_claim_document(claim, found) for claim in found.claims]})
        return
    for claim in found.claims:
        sign = SIGNS[claim.direction]
        say(f"{claim.name}: {claim.measure} of {claim.first} {sign} {claim.second} by {claim.smallest_effect:g}")
        say(f"    {claim.text}")
        say(f"    refuted by: {claim.refuted_by}")
    counts = ", ".join(f"{len(found.seeds[use])} {use.value}" for use in SeedSet)
    needed = max(seeds_needed(claim, found) for claim in found.claims)
    say(f"{len(found.claims)} claims; seeds: {counts}; needed for a power of {found.power:g}: {needed}")


def _claim_document(claim: Claim, found: Claims) -> dict[str, object]:
    return {
        "name": claim.name,
        "text": claim.text,
        "family": claim.family,
        "scenario": claim.scenario,
        "measure": claim.measure,
        "first": claim.first,
        "second": claim.second,
        "direction": claim.direction.value,
        "smallest_effect": claim.smallest_effect,
        "seeds_needed": seeds_needed(claim, found),
        "refuted_by": claim.refuted_by,
    }


def _study(name: str) -> Study:
    look_in(Path.cwd())
    try:
        return find_study(name)
    except NoSuchStudy as error:
        raise BadInput(str(error)) from None


def verify_results(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A table of results, such as docs/results/NAME.csv.")],
    sample: Annotated[
        int, typer.Option("--sample", metavar="N", parser=whole(1, 100_000), help="So many rows, drawn by the seed.")
    ] = 5,
    seed: Annotated[int, typer.Option("--seed", metavar="N", parser=whole(0), help="Which rows are drawn.")] = 1,
    study: Annotated[
        str | None, typer.Option("--study", metavar="STUDY", help="The study, if it is not found by its name.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Keep the runs there; else they are removed.")
    ] = None,
) -> None:
    """Make runs of a table of results again, and compare digests and measures. Exits with 1 if any differs."""
    try:
        rows = sampled(read_table(file), sample, seed)
        if out is not None and out.exists() and not (out.is_dir() and not any(out.iterdir())):
            raise BadInput(f"--out: {out} is there already: name another folder")
        with tempfile.TemporaryDirectory(prefix="regraft-verify-") as temporary:
            differing = verify(rows, (out or Path(temporary)).resolve(), say, _study(study) if study else None)
    except (BadTable, NoSuchStudy) as error:
        raise BadInput(str(error)) from None
    except (NoRoom, CodeChanged, BadRun) as error:
        raise Failed(str(error)) from None
    wrong = len({(each.row.configuration, each.row.seed, each.row.number) for each in differing})
    say(f"{len(rows) - wrong} of {len(rows)} runs of {file} came out again")
    if differing:
        raise typer.Exit(FAILED)


def join_results(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Tables of results of one study.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The table to write.")],
) -> None:
    """Join tables of runs that were made in parts, with the same code, into one."""
    try:
        tables = [read_table(file) for file in files]
        empty = next((table.file for table in tables if not table.rows), None)
        if empty is not None:
            raise BadInput(f"{empty}: has no runs: leave it out")
        whole_table = joined(tables)
    except BadTable as error:
        raise BadInput(str(error)) from None
    try:
        write_whole(out, table_text(whole_table).encode())
    except OSError as error:
        raise Failed(f"{out}: cannot be written: {error.strerror}") from None
    say(f"{out}: {len(whole_table.rows)} runs of {len(tables)} tables")


def fill_tables(
    pages: Annotated[list[Path], typer.Argument(metavar="PAGE...", help="Markdown pages with marked tables.")],
    check: Annotated[bool, typer.Option("--check", help="Change nothing: exit with 1 if a table is stale.")] = False,
) -> None:
    """Fill the tables of pages from the results that they name."""
    texts = {page: _filled(page) for page in pages}
    stale = [page for page, (before, after) in texts.items() if before != after]
    for page, (_, after) in texts.items():
        if page in stale and not check:
            try:
                write_whole(page, after.encode())
            except OSError as error:
                raise Failed(f"{page}: cannot be written: {error.strerror}") from None
        say(f"{page}: {'up to date' if page not in stale else 'stale' if check else 'tables filled'}")
    if check and stale:
        raise typer.Exit(FAILED)


def _filled(page: Path) -> tuple[str, str]:
    """Return the text of a page, and that with its tables filled; raises BadInput, StackError."""
    try:
        return page.read_text(encoding="utf-8"), filled(page)
    except (BadPage, BadTable, NoSuchStudy) as error:
        raise BadInput(str(error)) from None
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{page}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
