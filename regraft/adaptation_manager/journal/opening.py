"""Opens the journal at its run's place, and finds what it has lost: the hosts know how far it had come.

A journal may be cut off, changed or deleted while nobody looks. An adaptation that was reported as done stays done, and
no revision or number is given twice: the first host keeps the journal's end, and all hosts keep what they were given.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from regraft.adaptation_manager.journal.journal import Journal, JournalCorrupt, OpenLine, set_aside
from regraft.adaptation_manager.journal.revisions import architecture_at
from regraft.bus_schema.messages.protocol.host import HostView, JournalEnd, UpdateSpecs
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Outcome, StepState
from regraft.bus_schema.model.architecture import Architecture

END_LOST = "the journal had lost its end, the hosts know it"
HOW_LOST = "the journal has lost how it ended; a later adaptation was applied"
BEFORE_LOST = "the journal has lost what was before; it began anew with what the hosts run"

Tell = Callable[[str, str], object]
"""Makes an event of a kind and a text."""


@dataclass(slots=True)
class Opening:
    """One opening of a journal: ``known`` is the architecture that the manager knew before, if it did."""

    journal: Journal
    views: Sequence[HostView]
    known: Architecture | None
    now: float
    tell: Tell

    @property
    def end(self) -> JournalEnd:
        """How far the journal had come, as others know."""
        ends = [view.journal for view in self.views]
        known = self.known.revision if self.known else 0
        return JournalEnd(
            max(end.line for end in ends),
            max(known, *(end.revision for end in ends)),
            max(end.told for end in ends),
            max(end.gave for end in ends),
        )

    def architecture(self) -> Architecture:
        """Find this run's place; returns the architecture that holds there. Raises JournalError.

        On a run's first opening, the stack's start becomes its first line.
        """
        run = self.views[0].run
        self.journal.sift(run)
        if not self.journal.knows(run):
            return self._begin(run, lost=any(view.term for view in self.views))
        self.journal.run = run
        for line in reversed(self.journal.open_lines()):
            self._close_if_ended(line)
        found = architecture_at(self.journal)
        if found is None or found.revision < self.end.revision:
            return self._begin(run, lost=True)
        return found

    def _close_if_ended(self, line: OpenLine) -> None:
        """Close an open line of which the hosts know that it has ended: its end was written, and is lost."""
        gave = self.end.gave
        if int(line.report.id) < gave:  # one after it was applied: nothing of it is under way
            self.journal.end(replace(line.report, outcome=Outcome.STUCK, error=HOW_LOST))
        elif int(line.report.id) == gave and line.following is not None:
            self._close_applied(line, line.following)

    def _close_applied(self, line: OpenLine, following: UpdateSpecs) -> None:
        steps = tuple(replace(step, state=StepState.DONE) for step in line.report.steps)
        report = replace(
            line.report, outcome=Outcome.APPLIED, revision_after=following.revision, steps=steps, error=END_LOST
        )
        self.journal.end(report)
        self.tell("journal.damaged", f"adaptation {report.id} was applied: {END_LOST}")

    def _begin(self, run: str, *, lost: bool) -> Architecture:
        """Begin the run's journal, or begin it again with the architecture as it is."""
        self.journal.run = run
        architecture = self.known or in_force(self.views)
        number = max(self.journal.last_number(), self.end.line) + 1
        if lost:
            for line in self.journal.open_lines():  # to undo them would lead away from what the hosts run
                self.journal.end(replace(line.report, outcome=Outcome.STUCK, error=BEFORE_LOST))
            architecture = replace(architecture, revision=self._revision())
            number = max(number, architecture.revision)
            self.tell(
                "journal.lost",
                f"{self.journal.path} does not know all of this run, which was adapted before: its journal begins anew "
                f"at revision {architecture.revision}, with what the hosts run; what was done before cannot be undone, "
                "and what is lost cannot be read",
            )
        self.journal.start_run(run, _start(architecture, number, self.now), architecture)
        return architecture

    def _revision(self) -> int:
        """Return the revision of what the hosts run: the last that was published, if that is what they were given
        last.
        """
        given = max(view.revision for view in self.views)
        end, written = self.end, self.journal.last_revision()
        if end.revision > written and end.revision >= max(given, end.told):
            return end.revision
        return max(end.revision, end.told, written, given - 1) + 1


def opened(path: str, tell: Tell) -> Journal:
    """Open the journal at ``path``; a damaged one is set aside, and another begins. Raises JournalError."""

    def say(text: str) -> None:
        tell("journal.damaged", text)

    try:
        return Journal(path, say)
    except JournalCorrupt as error:
        aside = set_aside(path)
        tell("journal.corrupt", f"{error}; it was set aside as {aside}, a new journal begins")
        return Journal(path, say)


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


def _start(architecture: Architecture, number: int, now: float) -> AdaptationReport:
    """Return the first line; of a journal that begins again, it is numbered past all lines of the lost one."""
    request, revision = AdaptationRequest((), "the stack's start", "regraft up"), architecture.revision
    return AdaptationReport(str(number), Outcome.APPLIED, request, revision - 1, revision, now)
