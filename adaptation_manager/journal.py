"""The journal: every adaptation, written ahead, in SQLite.

What is committed here outlives the manager, however that ends. After a power loss the last lines may be missing,
never half there: the whole system is gone then, and starts as a new run. What is written ahead goes into the file
itself beside the work (``write_back``).
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from adaptation_manager.journal_schema import SCHEMA, VERSION
from adaptation_manager.plan import Plan
from adaptation_manager.steps.actions import PlannedStep
from adaptation_manager.write_back import WriteBack
from bus_schema import codec
from bus_schema.adaptation import APPLIED, AdaptationReport, Outcome, StepState
from bus_schema.architecture import Architecture
from bus_schema.messages.host import UpdateSpecs


class JournalError(Exception):
    """The journal cannot be written or read now: full disk, no right, locked; the text says which."""


class JournalCorrupt(JournalError):
    """The file is no journal, or a damaged one."""


@dataclass(frozen=True, slots=True)
class OpenLine:
    """An adaptation that was begun and not ended: its report, what it changes in the architecture, steps so far."""

    report: AdaptationReport
    following: UpdateSpecs
    steps: tuple[tuple[PlannedStep, StepState], ...]


class Journal:
    """The journal of one system; a file holds all its runs, one of which is current (``run``)."""

    def __init__(self, path: str) -> None:
        """Open ``path``, new if need be; empty for one in memory. Raises JournalError, JournalCorrupt."""
        self.path = path
        self.run = ""
        self.term = 0
        self._write_back = WriteBack(path)
        with self._told("cannot be opened"):
            if path:
                Path(path).parent.mkdir(parents=True, exist_ok=True)
            self._database = sqlite3.connect(path or ":memory:", timeout=1.0, isolation_level=None)
        try:
            with self._told("cannot be opened"):
                self._prepare()
        except JournalError:
            self._database.close()
            raise

    def _prepare(self) -> None:
        self._database.execute("PRAGMA journal_mode = WAL")
        self._database.execute("PRAGMA synchronous = NORMAL")
        self._write_back.prepare(self._database)
        (version,) = self._database.execute("PRAGMA user_version").fetchone()
        if version == 0:
            self._database.executescript(f"BEGIN;{SCHEMA}PRAGMA user_version = {VERSION};COMMIT;")
        elif version != VERSION:
            raise JournalCorrupt(f"the journal {self.path} has version {version}, must be {VERSION}")
        (verdict,) = self._database.execute("PRAGMA quick_check(1)").fetchone()
        if verdict != "ok":
            raise JournalCorrupt(f"the journal {self.path} is damaged: {verdict}")

    @contextlib.contextmanager
    def _told(self, what: str) -> Iterator[None]:
        """Turn SQLite's and the system's errors into ours."""
        try:
            yield
        except (sqlite3.OperationalError, OSError) as error:
            raise JournalError(f"the journal {self.path or 'in memory'} {what}: {error}") from None
        except (sqlite3.DatabaseError, ValueError) as error:
            raise JournalCorrupt(f"the journal {self.path or 'in memory'} {what}: {error}") from None

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._told("cannot be written"):
            self._database.execute("BEGIN IMMEDIATE")
            try:
                yield self._database
                self._database.execute("COMMIT")
                self._write_back.committed()
            except BaseException:
                if self._database.in_transaction:
                    self._database.execute("ROLLBACK")
                raise

    def close(self) -> None:
        """Close the file."""
        with contextlib.suppress(sqlite3.Error):
            self._database.close()

    # --- reigns and runs ---

    def next_term(self, above: int) -> int:
        """Return a term that is higher than ``above`` and than any before, and remember it."""
        with self._transaction() as database:
            (term,) = database.execute("SELECT term FROM reign").fetchone()
            term = max(term, above) + 1
            database.execute("UPDATE reign SET term = ?", (term,))
        self.term = int(term)
        return self.term

    def knows(self, run: str) -> bool:
        """Tell whether a run has begun here."""
        with self._told("cannot be read"):
            return self._database.execute("SELECT 1 FROM runs WHERE run = ?", (run,)).fetchone() is not None

    def start_run(self, run: str, report: AdaptationReport, architecture: Architecture) -> None:
        """Begin a run with the stack's start as its first line."""
        with self._transaction() as database:
            database.execute("INSERT INTO runs VALUES (?, ?)", (run, codec.encode(architecture)))
            self._insert(run, report, UpdateSpecs(report.revision_after))
        self.run = run

    def architecture(self, revision: int | None = None) -> Architecture | None:
        """Return the architecture at a revision of this run (None: the newest), None if there is none."""
        with self._told("cannot be read"):
            (start,) = self._database.execute("SELECT architecture FROM runs WHERE run = ?", (self.run,)).fetchone()
            architecture = codec.decode(start, Architecture)
            rows = self._database.execute(
                "SELECT following FROM adaptations WHERE run = ? AND revision > ? ORDER BY revision",
                (self.run, architecture.revision),
            )
            for (following,) in rows:
                if architecture.revision == revision:
                    break
                architecture = codec.decode(following, UpdateSpecs).applied_to(architecture)
        return architecture if revision in (None, architecture.revision) else None

    # --- adaptations ---

    def begin(self, report: AdaptationReport, plan: Plan) -> None:
        """Write an adaptation ahead, its first step as started: from here on it is finished or undone.

        Raises:
            JournalError: it cannot be written, or a manager with a later term keeps this journal by now.
        """
        with self._transaction() as database:
            self._check_term()
            self._insert(self.run, report, plan.changes)
            for step, planned in enumerate(plan.steps, start=1):
                state = StepState.STARTED if step == 1 else StepState.PLANNED
                row = (self.run, int(report.id), step, state.value, codec.encode(planned))
                database.execute("INSERT INTO steps VALUES (?, ?, ?, ?, ?)", row)

    def confirming(self, report: AdaptationReport) -> None:
        """Note that an adaptation was carried out, and is to be confirmed: until it is, it stays open."""
        number = int(report.id)
        with self._transaction() as database:
            self._note(number, {step.number: step.state for step in report.steps})
            database.execute(
                "UPDATE adaptations SET outcome = ?, report = ? WHERE run = ? AND number = ?",
                (report.outcome.value, codec.encode(report), self.run, number),
            )

    def _check_term(self) -> None:
        (term,) = self._database.execute("SELECT term FROM reign").fetchone()
        if term > self.term:
            raise JournalError(f"the journal is kept under term {term} by now, this manager's is {self.term}")

    def record(self, report: AdaptationReport) -> None:
        """Write an adaptation that ended before it began: rejected, or cancelled while it waited."""
        with self._transaction():
            self._insert(self.run, report, UpdateSpecs(report.revision_after))
        self._write_back.if_due()

    def _insert(self, run: str, report: AdaptationReport, following: UpdateSpecs) -> None:
        request = report.request
        row = (
            run,
            int(report.id),
            request.key,
            request.who,
            request.reason,
            report.outcome.value,
            _revision(report),
            codec.encode(report),
            codec.encode(following),
        )
        self._database.execute("INSERT INTO adaptations VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", row)

    def progress(self, number: int, states: Mapping[int, StepState]) -> None:
        """Note how far steps (counted from 1) of an open adaptation have come."""
        with self._transaction():
            self._note(number, states)

    def _note(self, number: int, states: Mapping[int, StepState]) -> None:
        rows = [(state.value, self.run, number, step) for step, state in states.items()]
        self._database.executemany("UPDATE steps SET state = ? WHERE run = ? AND number = ? AND step = ?", rows)

    def end(self, report: AdaptationReport) -> None:
        """Close an open adaptation; if it was applied, its architecture holds from here on.

        Of one that was told of and then undone, the revision is kept that it had: it is not given again. Raises as
        ``begin`` does: what a manager with a later term has found open is that one's to close.
        """
        number = int(report.id)
        with self._transaction() as database:
            self._check_term()
            self._note(number, {step.number: step.state for step in report.steps})
            if _revision(report) is None:
                self._take_back(report)
            database.execute(
                "UPDATE adaptations SET outcome = ?, revision = ?, report = ? WHERE run = ? AND number = ?",
                (report.outcome.value, _revision(report), codec.encode(report), self.run, number),
            )
        self._write_back.if_due()

    def _take_back(self, report: AdaptationReport) -> None:
        """Keep of what was to follow only the revision, if that was told of."""
        place = (self.run, int(report.id))
        (outcome, following) = self._database.execute(
            "SELECT outcome, following FROM adaptations WHERE run = ? AND number = ?", place
        ).fetchone()
        told = codec.decode(following, UpdateSpecs).revision if outcome == Outcome.CONFIRMING.value else 0
        nothing = codec.encode(UpdateSpecs(max(told, report.revision_after)))
        self._database.execute("UPDATE adaptations SET following = ? WHERE run = ? AND number = ?", (nothing, *place))

    # --- reading ---

    def last_number(self) -> int:
        """Return the highest number of this run's adaptations."""
        with self._told("cannot be read"):
            (last,) = self._database.execute(
                "SELECT coalesce(max(number), 0) FROM adaptations WHERE run = ?", (self.run,)
            ).fetchone()
        return int(last)

    def last_withdrawn(self) -> int:
        """Return the highest revision that was told of after the current one, and undone or about to be; 0 if none."""
        with self._told("cannot be read"):
            rows = self._database.execute(
                "SELECT following FROM adaptations WHERE run = ? "
                "AND outcome IN ('confirming', 'rolled_back', 'cancelled', 'stuck') AND number > "
                "(SELECT max(number) FROM adaptations WHERE run = ? AND revision IS NOT NULL)",
                (self.run, self.run),
            ).fetchall()
        return max((codec.decode(following, UpdateSpecs).revision for (following,) in rows), default=0)

    def _reports(self, where: str, *values: object) -> list[AdaptationReport]:
        with self._told("cannot be read"):
            rows = self._database.execute(
                f"SELECT report FROM adaptations WHERE run = ? AND {where}", (self.run, *values)
            ).fetchall()
            return [codec.decode(report, AdaptationReport) for (report,) in rows]

    def report(self, number: int) -> AdaptationReport | None:
        """Return one line."""
        return next(iter(self._reports("number = ?", number)), None)

    def by_key(self, key: str) -> AdaptationReport | None:
        """Return the line of an idempotency key."""
        return next(iter(self._reports("key = ? AND key != ''", key)), None)

    def page(self, before: int | None, limit: int) -> list[AdaptationReport]:
        """Return lines older than ``before`` (None: from the newest), newest first."""
        top = 2**62 if before is None else before
        return self._reports("number < ? ORDER BY number DESC LIMIT ?", top, limit)

    def applied_after(self, number: int) -> list[AdaptationReport]:
        """Return the applied lines after ``number``, newest first."""
        return self._reports("number > ? AND revision IS NOT NULL ORDER BY number DESC", number)

    def past(self, limit: int) -> list[tuple[AdaptationReport, tuple[PlannedStep, ...]]]:
        """Return up to ``limit`` applied lines with their steps, oldest first; lines of this run are preferred."""
        with self._told("cannot be read"):
            rows = self._database.execute(
                "SELECT run, number, report FROM adaptations WHERE revision IS NOT NULL AND number > 1 "
                "ORDER BY run = ? DESC, number DESC LIMIT ?",
                (self.run, limit),
            ).fetchall()
            found = []
            for run, number, report in reversed(rows):
                steps = self._database.execute(
                    "SELECT plan FROM steps WHERE run = ? AND number = ? ORDER BY step", (run, number)
                ).fetchall()
                planned = tuple(codec.decode(plan, PlannedStep) for (plan,) in steps)
                found.append((codec.decode(report, AdaptationReport), planned))
        return found

    def open_lines(self) -> list[OpenLine]:
        """Return the adaptations that were begun and not ended, newest first."""
        lines = []
        for report in self._reports("outcome IN ('pending', 'confirming') ORDER BY number DESC"):
            with self._told("cannot be read"):
                place = (self.run, int(report.id))
                (specs,) = self._database.execute(
                    "SELECT following FROM adaptations WHERE run = ? AND number = ?", place
                ).fetchone()
                following = codec.decode(specs, UpdateSpecs)
                rows = self._database.execute(
                    "SELECT plan, state FROM steps WHERE run = ? AND number = ? ORDER BY step", place
                ).fetchall()
                steps = tuple((codec.decode(plan, PlannedStep), StepState(state)) for plan, state in rows)
                lines.append(OpenLine(report, following, steps))
        return lines


def _revision(report: AdaptationReport) -> int | None:
    """Return the revision that a line gave, None if it gave none."""
    applied = report.outcome in APPLIED
    return report.revision_after if applied else None


def set_aside(path: str) -> str:
    """Rename a journal that cannot be read, and its side files; returns the new path. Raises JournalError."""
    number = 1
    while Path(aside := f"{path}.corrupt-{number}").exists():
        number += 1
    try:
        for suffix in ("", "-wal", "-shm"):
            if Path(path + suffix).exists():
                Path(path + suffix).rename(aside + suffix)
    except OSError as error:
        raise JournalError(f"the journal {path} cannot be set aside: {error}") from None
    return aside
