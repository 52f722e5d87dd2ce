"""The manager's store: the architecture as it should be, its revisions, and the journal behind both."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Sequence
from dataclasses import replace

from regraft.adaptation_manager.journal.journal import Journal, JournalError
from regraft.adaptation_manager.journal.opening import Opening, in_force, opened
from regraft.adaptation_manager.journal.revisions import keep_if_due
from regraft.adaptation_manager.planning.durations import REMEMBERED, Durations
from regraft.adaptation_manager.planning.plan import Plan
from regraft.bus_schema.messages.protocol.host import HostView, JournalEnd
from regraft.bus_schema.model.adaptation import AdaptationReport
from regraft.bus_schema.model.architecture import Architecture


class ArchitectureStore:
    """Open or not: without a journal the architecture can be read, but not changed."""

    def __init__(self, path: str, tell: Callable[[str, str], None]) -> None:
        """Keep the journal at ``path``; ``tell(kind, text)`` publishes events."""
        self.path = path
        self.architecture: Architecture | None = None
        self.unconfirmed: Architecture | None = None
        self.journal: Journal | None = None
        self._publish = tell
        self._untold: list[tuple[str, str]] = []
        self._is_opening = False
        self._number = 0
        self._withdrawn = 0
        self._gave = 0
        self._durations: Durations | None = None
        self._unwritten: list[AdaptationReport] = []
        self._tagged: Architecture | None = None
        self._tags = 0
        self._opened_as = secrets.token_hex(8)
        self._closed_because = "the journal has not been opened yet"

    # --- opening ---

    def open(self, views: Sequence[HostView], now: float) -> int:
        """Open the journal at this run's place; returns its term. Raises JournalError.

        On a run's first opening, the stack's start becomes its first line. A long journal takes seconds, so a thread of
        its own may do this. The store is closed meanwhile, and ``tell_all`` has to follow.
        """
        self.close()
        self._is_opening = True
        try:
            self.journal, term = self._at_place(views, now)
        except JournalError as error:
            self._closed_because = str(error)
            self.architecture = self.architecture or in_force(views)
            raise
        finally:
            self._is_opening = False
        return term

    def _at_place(self, views: Sequence[HostView], now: float) -> tuple[Journal, int]:
        journal = opened(self.path, self._tell)
        try:
            term = journal.next_term(max(view.term for view in views))
            opening = Opening(journal, views, self.architecture, now, self._tell)
            self.architecture = opening.architecture()
            self._number = max(self._number, journal.last_number(), opening.end.line)
            self._gave = journal.last_applied()
            self._withdrawn = max(self._withdrawn, journal.last_withdrawn(), opening.end.told)
        except JournalError:
            journal.close()
            raise
        return journal, term

    def tell_all(self) -> None:
        """Publish the events of what the opening has found."""
        while self._untold:
            self._publish(*self._untold.pop(0))

    def _tell(self, kind: str, text: str) -> None:
        self._untold.append((kind, text))
        if not self._is_opening:
            self.tell_all()

    def close(self, because: str = "the journal is closed") -> None:
        """Close the journal; what is known of the architecture stays."""
        self._closed_because = because
        if self.journal is not None:
            self.journal.close()
            self.journal = None

    def ready(self) -> Journal:
        """Return the journal, with everything written that is to be; raises JournalError."""
        if self.journal is None:
            raise JournalError(self._closed_because)
        if not self.journal.is_in_place():
            self._put_back(self.journal)
        while self._unwritten:
            self.journal.end(self._unwritten[0])
            del self._unwritten[0]
        return self.journal

    def _put_back(self, journal: Journal) -> None:
        """Write the journal to its place again; somebody has deleted or replaced the file. Raises JournalError."""
        other = journal.write_anew()
        found = f"the file that was found there is {other} now" if other else "it had been deleted"
        self._tell("journal.replaced", f"{self.path} was not this system's journal any more, and is again: {found}")

    def readable(self) -> Journal:
        """Return the journal to read it, also while it cannot be written; raises JournalError."""
        try:
            return self.ready()
        except JournalError:
            if self.journal is None:
                raise
            return self.journal

    def line(self, report: AdaptationReport) -> AdaptationReport:
        """Return a line as it ended, also if that could not be written yet."""
        return next((ended for ended in self._unwritten if ended.id == report.id), report)

    def durations(self) -> Durations:
        """Return how long the steps of past adaptations took; raises JournalError."""
        if self._durations is None:
            durations = Durations()
            for report, planned in self.readable().past(REMEMBERED):
                durations.learn(report, planned, self.current())
            self._durations = durations
        return self._durations

    # --- lines ---

    def end(self) -> JournalEnd:
        """Return how far the journal has come, for others to know if it is lost."""
        assert self.architecture is not None
        revision = self.architecture.revision
        return JournalEnd(self._number, revision, max(self._withdrawn, revision), self._gave)

    def next_number(self) -> int:
        """Return the number of a further adaptation."""
        self._number += 1
        return self._number

    def next_revision(self) -> int:
        """Return the revision that follows; one that was published and then undone is not given again."""
        assert self.architecture is not None
        return max(self.architecture.revision, self._withdrawn) + 1

    def current(self) -> Architecture:
        """Return the architecture as it should be now, also one that is not final yet."""
        assert self.architecture is not None
        return self.unconfirmed or self.architecture

    def tag(self) -> str:
        """Return what stands for the current architecture: another one has another, also in another process."""
        if self._tagged is not self.current():
            self._tagged = self.current()
            self._tags += 1
        return f"{self._opened_as}-{self._tags}"

    def confirming(self, report: AdaptationReport, architecture: Architecture) -> None:
        """Note that an adaptation waits for confirmation: its architecture is published, not final. Raises
        JournalError.
        """
        self.ready().confirming(report)
        self.unconfirmed = replace(architecture, unconfirmed=report.id)
        self._withdrawn = architecture.revision

    def applied(self, report: AdaptationReport, plan: Plan) -> None:
        """Close an applied adaptation, whose architecture holds from here on; raises JournalError."""
        journal = self.ready()
        journal.end(report)
        self.architecture, self.unconfirmed = plan.after, None
        self._gave = int(report.id)
        self._attempt(lambda: keep_if_due(journal, plan.after))
        if self._durations is not None:
            self._durations.learn(report, plan.steps, plan.after)

    def ended(self, report: AdaptationReport) -> None:
        """Close an adaptation that was begun and changed nothing; written later if it cannot be now."""
        self.unconfirmed = None
        self._unwritten.append(report)
        self._attempt(self.ready)

    def never_began(self, report: AdaptationReport) -> None:
        """Write the line of an adaptation that changed nothing; without space for it there is none."""
        self._attempt(lambda: self.ready().record(report))

    def _attempt(self, write: Callable[[], object]) -> None:
        try:
            write()
        except JournalError as error:
            self._tell("journal.unwritable", str(error))
