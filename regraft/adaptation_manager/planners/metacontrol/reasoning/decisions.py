"""The outcome of the plan step: a decision for each objective, with what was considered, as data and as text."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Set
from dataclasses import dataclass, field

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import GRAVITY
from regraft.adaptation_manager.planners.metacontrol.reasoning.assessment import Against, Assessment
from regraft.adaptation_manager.planners.metacontrol.reasoning.considering import Considered
from regraft.bus_schema.annotations import PlainValue


@dataclass(frozen=True, slots=True)
class Decision:
    """The decision for an objective.

    ``parent`` is the objective whose design requires it, empty for one of a client. ``present`` is the design that
    solves it now. ``design`` is None where there is none to select; ``status`` is then the objective's. ``refused``
    has the reasons why the objective has no meaning. ``considered`` is what the decision was made from: its words are
    made when they are asked for.
    """

    objective: str
    parent: str
    present: str | None
    design: str | None
    status: Status
    considered: Considered | None = field(default=None, repr=False, compare=False)
    refused: tuple[str, ...] = ()

    @property
    def is_change(self) -> bool:
        """Return whether another design is to be entered than the present one."""
        return self.design != self.present

    @property
    def assessments(self) -> tuple[Assessment, ...]:
        """Return the reasons for and against each design, in the order of the files."""
        return tuple(self.considered.assessments()) if self.considered is not None else ()

    @property
    def why(self) -> str:
        """Return in one line why there is this design, or why there is none."""
        return "; ".join(self._whys())

    def why_within(self, characters: int) -> str:
        """Return ``why``, shortened; only what is shown is put into words."""
        parts: list[str] = []
        left = characters
        for part in self._whys():
            parts.append(part)
            left -= len(part) + 2
            if left < 0:
                break
        return textwrap.shorten("; ".join(parts), characters, placeholder=" ...")

    def _whys(self) -> Iterator[str]:
        if self.refused or self.considered is None:
            yield from self.refused
        elif self.design is not None:
            utility = self.considered.ranking.utilities[self.design]
            yield f"{local_name(self.design)} has the utility {utility:.4g}"
        elif not self.considered.ranking.designs:
            yield "its function has no design in this context"
        else:
            for each in self.considered.assessments():
                yield f"{local_name(each.design)}: {each.against[0].why}"

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


def status_without_design(status: Status, kinds: Set[Against], required: Set[Status]) -> Status:
    """Return the status of an objective for which there is no design, by what speaks against the designs.

    ``required`` are the statuses of required objectives that have none themselves: their errors go up.
    """
    if status not in {Status.UNGROUNDED, Status.IN_PROGRESS}:
        return status
    if Against.UNREALISABLE in kinds:
        return Status.IN_ERROR_COMPONENT
    error = next((each for each in GRAVITY if each in required), None)
    if error is not None:
        return error
    if kinds & BROKEN:
        return Status.IN_ERROR_NFR
    return Status.UNGROUNDED if kinds else Status.IN_ERROR_FR
