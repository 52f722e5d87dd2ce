"""The journal: every adaptation, written ahead, in SQLite.

Committed rows outlive the manager, however that ends. After a power loss the last lines may be missing, never half
there: the whole system is gone then, and starts as a new run. Rows written ahead go into the file itself with the work
(``write_back``). A row that has changed since it was written is set aside and reported (``journal_damage``): the rest
continues.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from regraft.adaptation_manager.journal.database import JournalCorrupt, JournalDatabase, JournalError, set_aside
from regraft.adaptation_manager.journal.rows import decoded
from regraft.adaptation_manager.journal.schema import FOLLOWING, LINE, PLAN, STATE
from regraft.adaptation_manager.journal.seals import Field, is_sealed, seal
from regraft.adaptation_manager.planning.plan import Plan
from regraft.adaptation_manager.steps.actions import PlannedStep
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.host import UpdateSpecs
from regraft.bus_schema.model.adaptation import APPLIED, AdaptationReport, Outcome, StepState
from regraft.bus_schema.model.architecture import Architecture

__all__ = ["Journal", "JournalCorrupt", "JournalError", "OpenLine", "set_aside"]


@dataclass(frozen=True, slots=True)
class OpenLine:
    """An adaptation that was begun and not ended: its report, what it changes in the architecture, steps so far.

    A step that was damaged is None; so is what would follow.
    """

    report: AdaptationReport
    following: UpdateSpecs | None
    steps: tuple[tuple[PlannedStep, StepState] | None, ...]


class Journal(JournalDatabase):
    """The journal of one system; a file holds all its runs, one of which is current (``run``)."""

    def __init__(self, path: str, tell: Callable[[str], object] = lambda text: None) -> None:
        """Open ``path``, new if need be; empty for one in memory. Raises JournalError, JournalCorrupt.

        ``tell`` is called with rows that were set aside.
        """
        self.run = ""
        self.term = 0
        super().__init__(path, tell)

    # --- terms and runs ---

    def next_term(self, above: int) -> int:
        """Return a term that is higher than ``above`` and than any before, and remember it."""
        with self.transaction() as database:
            term = max(self._term(), above) + 1
            database.execute("UPDATE term SET term = ?, seal = ?", (term, seal(term)))
        self.term = term
        return term

    def _term(self) -> int:
        row = self.database.execute("SELECT term, seal FROM term").fetchone()
        return int(row[0]) if row is not None and is_sealed(row) else 0

    def _check_term(self) -> None:
        term = self._term()
        if term > self.term:
            raise JournalError(f"the journal is kept under term {term} by now, this manager's is {self.term}")

    def knows(self, run: str) -> bool:
        """Return whether a run has begun here."""
        with self.told("cannot be read"):
            return self.database.execute("SELECT 1 FROM runs WHERE run = ?", (run,)).fetchone() is not None

    def start_run(self, run: str, report: AdaptationReport, architecture: Architecture) -> None:
        """Begin a run with the stack's start as its first line.

        A run that is known begins again: earlier lines stay, but no architecture before this one can be read.
        """
        start: tuple[Field, ...] = (run, codec.encode(architecture))
        with self.transaction() as database:
            database.execute("INSERT OR REPLACE INTO runs VALUES (?, ?, ?)", (*start, seal(*start)))
            self._insert(run, report, UpdateSpecs(report.revision_after))
        self.run = run

    # --- adaptations ---

    def begin(self, report: AdaptationReport, plan: Plan) -> None:
        """Write an adaptation ahead, its first step as started: from here on it is finished or undone.

        Raises:
            JournalError: it cannot be written, or a manager with a later term keeps this journal by now.
        """
        with self.transaction() as database:
            self._check_term()
            self._insert(self.run, report, plan.changes)
            for step, planned in enumerate(plan.steps, start=1):
                state = StepState.STARTED if step == 1 else StepState.PLANNED
                place = (self.run, int(report.id), step)
                text, encoded = state.value, codec.encode(planned)
                row = (*place, text, seal(*place, text), encoded, seal(*place, encoded))
                database.execute("INSERT INTO steps VALUES (?, ?, ?, ?, ?, ?, ?)", row)

    def confirming(self, report: AdaptationReport) -> None:
        """Note that an adaptation was carried out, and is to be confirmed: until it is, it stays open."""
        with self.transaction():
            self._note(int(report.id), {step.number: step.state for step in report.steps})
            if not self._rewrite(report):
                raise JournalError(f"the journal {self.path} has no line {report.id} any more")

    def record(self, report: AdaptationReport) -> None:
        """Write an adaptation that ended before it began: rejected, or cancelled while it waited."""
        with self.transaction():
            self._insert(self.run, report, UpdateSpecs(report.revision_after))
        self.write_back.if_due()

    def _insert(self, run: str, report: AdaptationReport, following: UpdateSpecs) -> None:
        line = _line(run, report)
        changes: tuple[Field, ...] = (run, int(report.id), codec.encode(following))
        row = (*line, seal(*line), changes[2], seal(*changes))
        self.database.execute("INSERT INTO adaptations VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", row)

    def _rewrite(self, report: AdaptationReport) -> bool:
        """Write a line again with its present values; returns whether there is one."""
        line = _line(self.run, report)
        written = self.database.execute(
            "UPDATE adaptations SET key = ?, actor = ?, reason = ?, outcome = ?, revision = ?, report = ?, seal = ? "
            "WHERE run = ? AND number = ?",
            (*line[2:], seal(*line), *line[:2]),
        )
        return written.rowcount == 1

    def progress(self, number: int, states: Mapping[int, StepState]) -> None:
        """Note how far steps (counted from 1) of an open adaptation have come."""
        with self.transaction():
            self._note(number, states)

    def _note(self, number: int, states: Mapping[int, StepState]) -> None:
        places = [(state.value, (self.run, number, step)) for step, state in states.items()]
        rows = [(state, seal(*place, state), *place) for state, place in places]
        self.database.executemany(
            "UPDATE steps SET state = ?, seal = ? WHERE run = ? AND number = ? AND step = ?", rows
        )

    def end(self, report: AdaptationReport) -> None:
        """Close an open adaptation; if it was applied, its architecture holds from here on.

        The revision of one that was published and then undone is kept: it is not given again. Raises as ``begin`` does:
        what a manager with a later term has found open is that one's to close.
        """
        with self.transaction():
            self._check_term()
            self._note(int(report.id), {step.number: step.state for step in report.steps})
            if _revision(report) is None:
                self._take_back(report)
            if not self._rewrite(report):
                if _revision(report) is not None:
                    raise JournalError(f"the journal {self.path} has no line {report.id} any more")
                self._insert(self.run, report, UpdateSpecs(report.revision_after))
        self.write_back.if_due()

    def _take_back(self, report: AdaptationReport) -> None:
        """Of what was to follow, keep only the revision, if it was published."""
        place = (self.run, int(report.id))
        found = self.database.execute(
            f"SELECT outcome, {FOLLOWING}, following_seal FROM adaptations WHERE run = ? AND number = ?", place
        ).fetchone()
        told = 0
        if found is not None and found[0] == Outcome.CONFIRMING.value and is_sealed(found[1:]):
            told = decoded(found[3], UpdateSpecs).revision
        nothing = codec.encode(UpdateSpecs(max(told, report.revision_after)))
        self.database.execute(
            "UPDATE adaptations SET following = ?, following_seal = ? WHERE run = ? AND number = ?",
            (nothing, seal(*place, nothing), *place),
        )

    # --- reading ---

    def _rows(self, query: str, *values: object) -> list[tuple[Any, ...]]:
        with self.told("cannot be read"):
            return self.database.execute(query, (self.run, *values)).fetchall()

    def last_number(self) -> int:
        """Return the highest number of this run's adaptations, also of damaged ones."""
        ((written,),) = self._rows("SELECT coalesce(max(number), 0) FROM adaptations WHERE run = ?")
        ((aside,),) = self._rows("SELECT coalesce(max(number), 0) FROM damaged WHERE run = ?")
        return max(n for n in (written, aside, 0) if isinstance(n, int))

    def last_applied(self) -> int:
        """Return the number of the adaptation that gave the highest revision, 0 if there is none."""
        rows = self._rows(
            "SELECT number FROM adaptations WHERE run = ? AND revision IS NOT NULL ORDER BY revision DESC LIMIT 1"
        )
        return next((number for (number,) in rows if isinstance(number, int)), 0)

    def last_revision(self) -> int:
        """Return the highest revision that an adaptation of this run gave, 0 if there is none."""
        ((revision,),) = self._rows("SELECT coalesce(max(revision), 0) FROM adaptations WHERE run = ?")
        return revision if isinstance(revision, int) else 0

    def last_withdrawn(self) -> int:
        """Return the highest published revision after the current one that is or will be undone; 0 if none."""
        rows = self._rows(
            f"SELECT {FOLLOWING}, following_seal FROM adaptations WHERE run = ? "
            "AND outcome IN ('confirming', 'rolled_back', 'cancelled', 'stuck') AND number > "
            "(SELECT coalesce(max(number), 0) FROM adaptations WHERE run = ? AND revision IS NOT NULL)",
            self.run,
        )
        return max((decoded(row[2], UpdateSpecs).revision for row in rows if is_sealed(row)), default=0)

    def _reports(self, where: str, *values: object) -> list[AdaptationReport]:
        """Return the lines for which ``where`` holds; one that is damaged is set aside."""
        rows = self._rows(f"SELECT {LINE}, seal FROM adaptations WHERE run = ? AND {where}", *values)
        return [decoded(row[7], AdaptationReport) for row in self._whole(rows)]

    def _whole(self, rows: list[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
        """Return the rows that are as they were written; if others are not, they are looked for and set aside."""
        whole = [row for row in rows if is_sealed(row)]
        if len(whole) < len(rows):
            self.sift(self.run)
        return whole

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

    def applied_after(self, number: int, limit: int) -> list[AdaptationReport]:
        """Return up to ``limit`` applied lines after ``number``, newest first."""
        return self._reports("number > ? AND revision IS NOT NULL ORDER BY number DESC LIMIT ?", number, limit)

    def past(self, limit: int) -> list[tuple[AdaptationReport, tuple[PlannedStep, ...]]]:
        """Return up to ``limit`` applied lines with their steps, oldest first; lines of this run are preferred.

        Damaged rows are left out.
        """
        with self.told("cannot be read"):
            rows = self.database.execute(
                f"SELECT {LINE}, seal FROM adaptations WHERE revision IS NOT NULL AND number > 1 "
                "ORDER BY run = ? DESC, number DESC LIMIT ?",
                (self.run, limit),
            ).fetchall()
            found = []
            for row in reversed(rows):
                steps = self._planned(row[0], row[1])
                if is_sealed(row) and None not in steps:
                    planned = tuple(step for step in steps.values() if step is not None)
                    found.append((decoded(row[7], AdaptationReport), planned))
        return found

    def _planned(self, run: str, number: int) -> dict[int, PlannedStep | None]:
        """Return the steps of an adaptation by their number, None for a damaged one."""
        rows = self.database.execute(
            f"SELECT {PLAN}, plan_seal FROM steps WHERE run = ? AND number = ? ORDER BY step", (run, number)
        ).fetchall()
        return {row[2]: decoded(row[3], PlannedStep) if is_sealed(row) else None for row in rows}

    def open_lines(self) -> list[OpenLine]:
        """Return the adaptations that were begun and not ended, newest first."""
        return [
            self._opened(report)
            for report in self._reports("outcome IN ('pending', 'confirming') ORDER BY number DESC")
        ]

    def _opened(self, report: AdaptationReport) -> OpenLine:
        number = int(report.id)
        (following,) = self._rows(
            f"SELECT {FOLLOWING}, following_seal FROM adaptations WHERE run = ? AND number = ?", number
        )
        states = self._rows(f"SELECT {STATE}, seal FROM steps WHERE run = ? AND number = ? ORDER BY step", number)
        reached = {row[2]: StepState(row[3]) for row in states if is_sealed(row)}
        with self.told("cannot be read"):
            planned = self._planned(self.run, number)
        steps = []
        for step in range(1, len(report.steps) + 1):
            plan, state = planned.get(step), reached.get(step)
            steps.append((plan, state) if plan is not None and state is not None else None)
        changes = decoded(following[2], UpdateSpecs) if is_sealed(following) else None
        return OpenLine(report, changes, tuple(steps))


def _line(run: str, report: AdaptationReport) -> tuple[Field, ...]:
    request = report.request
    return (
        run,
        int(report.id),
        request.key,
        request.actor,
        request.reason,
        report.outcome.value,
        _revision(report),
        codec.encode(report),
    )


def _revision(report: AdaptationReport) -> int | None:
    """Return the revision that a line gave, None if it gave none."""
    return report.revision_after if report.outcome in APPLIED else None
