"""The outcome of the plan step: a decision for each objective, with what was considered, as data and as text."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.assessment import Against, Assessment
from regraft.bus_schema.annotations import PlainValue


@dataclass(frozen=True, slots=True)
class Decision:
    """The decision for an objective.

    ``parent`` is the objective whose design requires it, empty for one of a client. ``present`` is the design that
    solves it now. ``design`` is None where there is none to select; ``status`` is then the objective's. ``refused``
    has the reasons why the objective has no meaning.
    """

    objective: str
    parent: str
    present: str | None
    design: str | None
    status: Status
    assessments: tuple[Assessment, ...] = ()
    refused: tuple[str, ...] = ()

    @property
    def is_change(self) -> bool:
        """Return whether another design is to be entered than the present one."""
        return self.design != self.present

    @property
    def why(self) -> str:
        """Return in one line why there is this design, or why there is none."""
        if self.refused:
            return "; ".join(self.refused)
        if self.design is not None:
            chosen = next(each for each in self.assessments if each.design == self.design)
            return f"{local_name(self.design)} has the utility {chosen.utility:.4g}"
        if not self.assessments:
            return "its function has no design in this context"
        return "; ".join(f"{local_name(each.design)}: {each.against[0].why}" for each in self.assessments)

    def lines(self) -> Iterator[str]:
        """Yield the decision as lines of text."""
        chosen = local_name(self.design) if self.design is not None else "none"
        yield f"{local_name(self.objective)}: {chosen} ({self.status})"
        for reason in self.refused:
            yield f"  refused: {reason}"
        for each in self.assessments:
            for line in each.lines():
                yield f"  {line}"

    def as_data(self) -> dict[str, PlainValue]:
        """Return the decision as plain data."""
        return {
            "objective": self.objective,
            "parent": self.parent or None,
            "present": self.present,
            "design": self.design,
            "status": str(self.status),
            "refused": list(self.refused),
            "designs": [each.as_data() for each in self.assessments],
        }


@dataclass(frozen=True, slots=True)
class Plan:
    """The decisions of one cycle: each objective before those that its design requires."""

    decisions: tuple[Decision, ...]

    def of(self, objective: str) -> Decision | None:
        """Return the decision for an objective, None if there is none."""
        return next((each for each in self.decisions if each.objective == objective), None)

    def text(self) -> str:
        """Return all decisions as text."""
        return "\n".join(line for each in self.decisions for line in each.lines())

    def as_data(self) -> list[PlainValue]:
        """Return all decisions as plain data."""
        return [each.as_data() for each in self.decisions]


BROKEN = frozenset({Against.REQUIREMENT, Against.NO_ESTIMATE, Against.RESTING, Against.FAILED})


def status_without_design(status: Status, assessments: Collection[Assessment]) -> Status:
    """Return the status of an objective for which there is no design, by what speaks against the designs."""
    if status not in {Status.UNGROUNDED, Status.IN_PROGRESS}:
        return status
    kinds = {objection.kind for each in assessments for objection in each.against}
    if Against.UNREALISABLE in kinds:
        return Status.IN_ERROR_COMPONENT
    if kinds & BROKEN:
        return Status.IN_ERROR_NFR
    return Status.UNGROUNDED if kinds else Status.IN_ERROR_FR
