"""The manager's books: the architecture as it should be, its revisions, and the journal behind both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from adaptation_manager.durations import REMEMBERED, Durations
from adaptation_manager.journal import Journal, JournalCorrupt, JournalError, set_aside
from adaptation_manager.plan import Plan
from bus_schema.adaptation import AdaptationReport, AdaptationRequest, Outcome
from bus_schema.architecture import Architecture
from bus_schema.messages.host import HostView


class Books:
    """Open or not: without a journal the architecture can be read, but not changed."""

    def __init__(self, path: str, tell: Callable[[str, str], None]) -> None:
        """Keep the journal at ``path``; ``tell(kind, text)`` makes events."""
        self.path = path
        self.architecture: Architecture | None = None
        self.unconfirmed: Architecture | None = None
        self.journal: Journal | None = None
        self._tell = tell
        self._number = 0
        self._withdrawn = 0
        self._durations: Durations | None = None
        self._unwritten: list[AdaptationReport] = []
        self._closed_because = "the journal has not been opened yet"

    # --- opening ---

    def open(self, views: Sequence[HostView], now: float) -> int:
        """Open the journal at this run's place; returns the term of this reign. Raises JournalError.

        On a run's first opening, the stack's start becomes its first line.
        """
        self.close()
        if self.architecture is None:
            self.architecture = in_force(views)
        try:
            self.journal, term = self._at_place(views[0].run, max(view.term for view in views), now)
        except JournalError as error:
            self._closed_because = str(error)
            raise
        return term

    def _at_place(self, run: str, term: int, now: float) -> tuple[Journal, int]:
        assert self.architecture is not None
        journal = self._opened()
        try:
            if journal.knows(run):
                journal.run = run
                self.architecture = journal.architecture() or self.architecture
            else:
                self._say_if_lost(term)
                journal.start_run(run, _start(self.architecture, now), self.architecture)
            self._number = max(self._number, journal.last_number())
            self._withdrawn = max(self._withdrawn, journal.last_withdrawn())
            term = journal.next_term(term)
        except JournalError:
            journal.close()
            raise
        return journal, term

    def _say_if_lost(self, term: int) -> None:
        """Whoever reigned over this run before has kept a journal of it, which is not this one."""
        if term and self.architecture is not None:
            self._tell(
                "journal.lost",
                f"{self.path} knows nothing of this run, which was adapted before: its journal begins anew at revision "
                f"{self.architecture.revision}; what was done before can be neither read nor undone",
            )

    def _opened(self) -> Journal:
        try:
            return Journal(self.path)
        except JournalCorrupt as error:
            aside = set_aside(self.path)
            self._tell("journal.corrupt", f"{error}; it was set aside as {aside}, a new journal begins")
            return Journal(self.path)

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
        while self._unwritten:
            self.journal.end(self._unwritten[0])
            del self._unwritten[0]
        return self.journal

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

    def next_number(self) -> int:
        """Return the number of a further adaptation."""
        self._number += 1
        return self._number

    def next_revision(self) -> int:
        """Return the revision that follows; one that was told of and then undone is not given again."""
        assert self.architecture is not None
        return max(self.architecture.revision, self._withdrawn) + 1

    def current(self) -> Architecture:
        """Return the architecture as it should be now, also one that is not final yet."""
        assert self.architecture is not None
        return self.unconfirmed or self.architecture

    def confirming(self, report: AdaptationReport, architecture: Architecture) -> None:
        """Note that an adaptation is to be confirmed: its architecture is told, but not final. Raises JournalError."""
        self.ready().confirming(report)
        self.unconfirmed = replace(architecture, unconfirmed=report.id)
        self._withdrawn = architecture.revision

    def applied(self, report: AdaptationReport, plan: Plan) -> None:
        """Close an applied adaptation, whose architecture holds from here on; raises JournalError."""
        self.ready().end(report)
        self.architecture, self.unconfirmed = plan.after, None
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


def in_force(views: Sequence[HostView]) -> Architecture:
    """Return the architecture as the hosts run it: the stack's, with the specs that they have by now."""
    architecture = views[0].architecture
    revisions = (architecture.revision, *(view.revision for view in views))
    architecture = replace(architecture, revision=max(1, *revisions))
    for view in views:
        specs = {spec.name: spec for spec in view.specs}
        gone = [n for n, spec in architecture.components.items() if spec.host == view.host and n not in specs]
        architecture = architecture.without(gone)
        architecture = replace(architecture, components=architecture.components | specs)
    return architecture


def _start(architecture: Architecture, now: float) -> AdaptationReport:
    """Return the first line. It is numbered as its revision, past whatever a lost journal had applied."""
    request, revision = AdaptationRequest((), "the stack's start", "regraft up"), architecture.revision
    return AdaptationReport(str(revision), Outcome.APPLIED, request, revision - 1, revision, now)
