"""The directory of one run: made next to the others, moved among them when the run is over and all of it is there.

``stack/AS_RUN`` is the stack as it was run, with all that it needs next to it; ``rows.csv`` and ``adaptations.csv``
hold simulated quantities only, and are equal for equal runs; ``run.json`` has what was run and how it ended; what
depends on the machine is in ``timing.csv`` and ``logs/``.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
import sqlite3
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing as closed_after
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.model.adaptation import AdaptationReport, Outcome, Phase
from regraft.evaluation.rows import TIME, Rows, read_rows, written
from regraft.evaluation.runs.attempts import FAILED, INCOMPLETE, Cause, causes_in, told
from regraft.evaluation.runs.elsewhere import document_of, lead_out, with_absolute
from regraft.evaluation.runs.fingerprint import (
    Fingerprint,
    code_hash,
    files_hash,
    fingerprint_from,
    leads_back,
    packages_named,
    stack_hash,
    versions,
)
from regraft.evaluation.runs.folder_lock import LOCK
from regraft.evaluation.study import Changes, Configuration, RunRecord, Timing
from regraft.stack import plain_document
from regraft.stack.assembly.assemble import assemble
from regraft.stack.yaml.document import read_map
from regraft.stack.yaml.dump import dumped
from regraft.stack.yaml.nodes import plain

AS_RUN: Final = "as_run.yaml"
STACK, ROWS, ADAPTATIONS, TIMING, RUN = "stack", "rows.csv", "adaptations.csv", "timing.csv", "run.json"
JOURNAL: Final = "journal.sqlite"
NEARLY: Final = 1e-6
"""Seconds by which simulated times that are equal may differ."""
WALL_CLOCK: Final = ("wall_s", "startup_s", "real_time_factor")
"""The fields of a closing line that depend on the machine."""


class BadRun(Exception):
    """A run failed, or its directory does not hold what it should; the text states why, ``causes`` for programs."""

    def __init__(self, text: str, causes: Iterable[Cause] = ()) -> None:
        """Have it that of the whole run if no causes are given."""
        super().__init__(text)
        self.causes = tuple(causes) or (Cause(FAILED, "", text),)


@dataclass(frozen=True, slots=True)
class Plan:
    """One run to be made: the run's ``number`` among those of its configuration, and what is different in it."""

    study: str
    definitions: str
    configuration: Configuration
    number: int
    seed: int
    seconds: float
    stack: Path
    changes: tuple[Changes, ...]

    @property
    def name(self) -> str:
        """Return the name of its directory."""
        return f"{self.configuration.key}/{self.number:03d}"

    @property
    def system(self) -> str:
        """Return the name of its system, which an included stack file may have; empty without one."""
        return str(self._changed(plain_document(self.stack)).get("system", ""))

    @property
    def folder(self) -> Path:
        """The folder of the stack file, from which its relative paths are looked for."""
        return self.stack.resolve().parent

    def document(self) -> dict[str, Any]:
        """Return the stack file with all that is different; what it includes stays in files of its own.

        Raises:
            StackError: the file cannot be read.
        """
        return self._changed(plain(read_map(self.stack)))

    def _changed(self, document: dict[str, Any]) -> dict[str, Any]:
        for changes in self.changes:
            document = merged(document, changes)
        return deepcopy(document)

    def fingerprint(self, hash_code: Callable[[Sequence[str]], str] = code_hash) -> Fingerprint:
        """Return the fingerprint of the run if it is made now; ``hash_code`` may remember what `code_hash` returns."""
        folder = self.folder
        whole = self._changed(document_of(assemble(self.stack).document, folder))
        document = with_absolute(whole, folder, folder, os.path.isfile)
        packages = packages_named(document)
        return Fingerprint(
            hash_code(packages),
            versions(packages),
            stack_hash(document, folder),
            files_hash(folder),
            self.seed,
            self.seconds,
        )


def merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return two maps as one: maps in both are merged, anything else is taken from ``over``.

    >>> merged({"a": {"x": 1, "y": 2}, "b": [1]}, {"a": {"y": 3}, "b": [2]})
    {'a': {'x': 1, 'y': 3}, 'b': [2]}
    """
    found = dict(under)
    for key, value in over.items():
        below = found.get(key)
        found[key] = merged(below, value) if isinstance(below, Mapping) and isinstance(value, Mapping) else value
    return found


def prepare(plan: Plan, home: Path) -> Path:
    """Make the directory of a run that is to be made, in place of what is there; return the stack file to run."""
    if home.exists():
        shutil.rmtree(home)
    shutil.copytree(plan.folder, home / STACK, ignore=partial(_left_out, plan.folder))
    lead_out(plan.folder, home / STACK)
    file = home / STACK / AS_RUN
    file.unlink(missing_ok=True)
    file.write_text(dumped(with_absolute(plan.document(), plan.folder, plan.folder)))
    return file


def _left_out(stack: Path, folder: str, names: list[str]) -> set[str]:
    """Return what a run leaves out of a folder in the stack's: what has no part in its fingerprint.

    That is code, campaigns next to the stack, what is hidden or no file, and links in a circle.
    """
    inside = Path(folder)
    hidden = {name for name in names if name.startswith(".")}
    circles = {name for name in names if (inside / name).is_dir() and leads_back(stack, folder, name)}
    campaigns = {name for name in names if (inside / name / LOCK).is_file()}
    special = {name for name in names if not ((inside / name).is_dir() or (inside / name).is_file())}
    code = shutil.ignore_patterns("*.py", "__pycache__", "*.pyc")(folder, names)
    return hidden | circles | campaigns | special | code


def complete(plan: Plan, home: Path, closing: Mapping[str, Any], made_of: Fingerprint) -> None:
    """Write what is to be kept of a finished run, in the folder where it was made; ``made_of`` is its fingerprint.

    The rest is left out.

    Raises:
        BadRun: it did not come to its end, or not in a way that can be repeated.
        OSError: there is no room.
    """
    system = home / str(closing.get("system") or plan.system)
    if not (system / ROWS).is_file():
        raise BadRun(f"no rows were written: the stack needs a recorder with the parameter file: $RUN/{ROWS}")
    causes = causes_in(closing)
    if not closing.get("reproducible"):
        raise BadRun(f"it cannot be repeated: {told(causes)}", causes)
    if closing.get("restarts") and causes:  # a schedule may end parts, too: that is no cause
        raise BadRun(f"parts had to be restarted, {closing['restarts']} times: {told(causes)}", causes)
    try:
        rows = read_rows(system / ROWS)
        if len(rows) and TIME not in rows.names():
            raise ValueError(f"{ROWS} has no column {TIME!r}")
        last = rows.number(TIME)[-1] if len(rows) else 0.0
    except ValueError as error:  # a row that was written in part, as on a disk that was full for a moment
        raise BadRun(str(error), [Cause(INCOMPLETE, "", str(error))]) from None
    wanted = last if rows.are_over else plan.seconds
    if last < wanted - 1.5:
        text = f"the rows end at {last:g} s of {plan.seconds:g} s"
        raise BadRun(text, [Cause(INCOMPLETE, "", text)])
    if len(rows) < wanted - 1.5:
        text = f"there are {len(rows)} rows of {wanted:g}: some could not be written"
        raise BadRun(text, [Cause(INCOMPLETE, "", text)])
    (system / ROWS).replace(home / ROWS)
    adaptations = _until_the_end_of(rows, _journal(system / JOURNAL))
    for name in (JOURNAL, f"{JOURNAL}-wal", f"{JOURNAL}-shm"):
        if (system / name).is_file():
            (system / name).replace(home / name)
    (system / "logs").replace(home / "logs")
    shutil.rmtree(system)
    _write_adaptations(home / ADAPTATIONS, adaptations)
    _write_timing(home / TIMING, closing, adaptations)
    closed = {name: value for name, value in closing.items() if name not in WALL_CLOCK}
    about = {
        "study": plan.study,
        "definitions": plan.definitions,
        "configuration": plan.configuration.key,
        "number": plan.number,
        "seed": plan.seed,
        "seconds": plan.seconds,
        "fingerprint": made_of.plain(),
        "closing": closed,
    }
    (home / RUN).write_text(json.dumps(about, indent=1, sort_keys=True) + "\n")


def _journal(path: Path) -> list[AdaptationReport]:
    """Return the adaptations of a journal that changed something, in their order; none without a journal."""
    if not path.is_file():
        return []
    try:
        with closed_after(sqlite3.connect(path)) as journal:
            found = journal.execute("SELECT report FROM adaptations ORDER BY number").fetchall()
        reports = [codec.decode(report, AdaptationReport) for (report,) in found if report is not None]
    except (sqlite3.Error, SchemaError) as error:
        raise BadRun(f"{path.name} cannot be read: {error}") from None
    return [report for report in reports if report.request.changes]


def _until_the_end_of(rows: Rows, adaptations: Sequence[AdaptationReport]) -> list[AdaptationReport]:
    """Return the adaptations that count: after a last row that comes before the end, it depends on when that is."""
    if not rows.are_over:
        return [*adaptations]
    end = rows.number(TIME)[-1]
    return [_as_of(end, report) for report in adaptations if report.started <= end]


def _as_of(end: float, report: AdaptationReport) -> AdaptationReport:
    """Return a report as it was at the last row: without what has come of a confirmation that ends later."""
    watched = [phase.duration for phase in report.phases if phase.phase is Phase.CONFIRM]
    ended_later = any(report.started + duration > end - NEARLY for duration in watched)
    if report.outcome is not Outcome.CONFIRMING and not ended_later:
        return report
    return replace(
        report,
        outcome=Outcome.CONFIRMING,
        revision_after=report.revision_before,
        steps=(),
        error="",
        architecture=None,
        broken=(),
        unreached=(),
    )


def _write_adaptations(path: Path, adaptations: Sequence[AdaptationReport]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow((TIME, "outcome", "actor", "changes"))
        for report in adaptations:
            changes = json.dumps(codec.to_plain(report.request)["changes"], sort_keys=True)
            writer.writerow((written(report.started), report.outcome.value, report.request.actor, changes))


def _write_timing(path: Path, closing: Mapping[str, Any], adaptations: Sequence[AdaptationReport]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("what", TIME, "wall_s"))
        writer.writerow(("startup", "", written(float(closing.get("startup_s") or 0.0))))
        writer.writerow(("run", "", written(float(closing.get("wall_s") or 0.0))))
        for report in adaptations:
            writer.writerow(("adaptation", written(report.started), written(report.duration)))


def read_run(home: Path, configuration: Configuration) -> RunRecord:
    """Return a finished run; raises BadRun."""
    try:
        about = json.loads((home / RUN).read_text())
        rows = read_rows(home / ROWS)
        with (home / TIMING).open(newline="") as file:
            timing = [(line["what"], float(line["wall_s"])) for line in csv.DictReader(file)]
        costs = {what: seconds for what, seconds in timing if what != "adaptation"}
        spent = tuple(seconds for what, seconds in timing if what == "adaptation")
        return RunRecord(
            configuration,
            int(about["number"]),
            int(about["seed"]),
            float(about["seconds"]),
            rows,
            tuple(_until_the_end_of(rows, _journal(home / JOURNAL))),
            about["closing"],
            Timing(costs["startup"], costs["run"], spent),
            _made_with(about),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadRun(f"{home}: {type(error).__name__}: {error}") from None


def _made_with(about: Mapping[str, Any]) -> dict[str, str]:
    """Return the hash of the code, and the versions as one text."""
    made_of = fingerprint_from(about.get("fingerprint"))
    if made_of is None:
        return {}
    named = sorted(made_of.dependencies.items())
    return {"code": made_of.code, "versions": ", ".join(f"{name} {value}" for name, value in named)}


def renderer_of(home: Path) -> str:
    """Return what drew the pictures of a finished run, empty if it had none."""
    try:
        return str(json.loads((home / RUN).read_text())["closing"]["renderer"] or "")
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def fingerprint_of(home: Path) -> Fingerprint | None:
    """Return the fingerprint of a finished run, None if it has none."""
    try:
        return fingerprint_from(json.loads((home / RUN).read_text())["fingerprint"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
