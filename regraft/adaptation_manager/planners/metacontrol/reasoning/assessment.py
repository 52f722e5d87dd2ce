"""Reasons for and against a design: realisability, rest, requirements and utility, as data and as text."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.explanation import Reason
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Fact, fact_text, local_name, text
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus, Status
from regraft.bus_schema.annotations import PlainValue


class Against(StrEnum):
    """Why a design was not selected."""

    UNREALISABLE = "unrealisable"
    FAILED = "failed"
    RESTING = "resting"
    REQUIREMENT = "requirement"
    NO_ESTIMATE = "no estimate"
    CLASH = "clash"
    REQUIRED = "required objective"
    CIRCULAR = "circular"
    LESS_USEFUL = "less useful"


@dataclass(frozen=True, slots=True)
class Objection:
    """One thing that speaks against a design. ``holder`` is the objective to which a clashing design belongs.

    ``words`` is the text, or what makes it when it is asked for: most reasons are never read. ``status`` is that of the
    required objective that has no design, None for other objections.
    """

    kind: Against
    words: str | Callable[[], str] = field(compare=False)
    holder: str = ""
    status: Status | None = None

    @property
    def why(self) -> str:
        """Return the objection as text."""
        return self.words if isinstance(self.words, str) else self.words()


@dataclass(frozen=True, slots=True)
class Assessment:
    """Reasons for and against a design.

    ``parts`` are the qualities' shares of the utility. ``curves`` are the curves that they were read from, where there
    are any. ``missing`` are qualities without an estimate, which count with their worst values. ``met`` are
    requirements that the estimates meet, as text.
    """

    design: str
    utility: float
    parts: Mapping[str, float]
    missing: tuple[str, ...]
    met: tuple[str, ...]
    against: tuple[Objection, ...]
    is_present: bool = False
    is_selected: bool = False
    curves: Mapping[str, Curve] = field(default_factory=dict)

    def with_objection(self, objection: Objection) -> Assessment:
        """Return the same assessment with one more objection."""
        return replace(self, against=(*self.against, objection))

    def lines(self) -> Iterator[str]:
        """Yield the assessment as lines of text."""
        state = "selected" if self.is_selected else "not selected"
        yield f"{local_name(self.design)}: {state}{', present' if self.is_present else ''}, utility {self.utility:.4g}"
        for name, share in self.parts.items():
            curve = f", by the curve [{self.curves[name]}]" if name in self.curves else ""
            yield f"  {local_name(name)}: {share:+.4g} of the utility{curve}"
        for each in self.met:
            yield f"  for: {each}"
        for name in self.missing:
            yield f"  unknown: no estimate of {local_name(name)}; its worst value counts"
        for objection in self.against:
            yield f"  against: {objection.why}"

    def as_data(self) -> dict[str, PlainValue]:
        """Return the assessment as plain data."""
        against: list[PlainValue] = []
        for each in self.against:
            entry: dict[str, PlainValue] = {"kind": str(each.kind), "why": each.why}
            against.append({**entry, "holder": each.holder} if each.holder else entry)
        found: dict[str, PlainValue] = {
            "design": self.design,
            "selected": self.is_selected,
            "present": self.is_present,
            "utility": self.utility,
            "parts": dict(self.parts),
            "missing": list(self.missing),
            "for": list(self.met),
            "against": against,
        }
        if self.curves:
            found["curves"] = {name: [list(point) for point in curve.points] for name, curve in self.curves.items()}
        return found


def causes(reason: Reason | None) -> str:
    """Return what a conclusion rests on: the comparisons and statuses at the ends of its tree."""
    if reason is None:
        return "by the rules"
    found = list(dict.fromkeys(_ends(reason)))
    return f"{', '.join(found) or fact_text(reason.fact)} (rule {reason.rule or 'none: it was stated'})"


STATUSES = frozenset(
    {vocabulary.C_STATUS, vocabulary.FG_ERROR, vocabulary.CC_AVAILABILITY, vocabulary.CSPEC_AVAILABILITY}
)


def _ends(reason: Reason) -> Iterator[str]:
    if not reason.premises and reason.fact[0] in STATUSES:
        yield _status_text(reason.fact)
    if reason.checks:
        measured = [
            local_name(str(premise.fact[2]))
            for premise in reason.premises
            if premise.fact[0] == vocabulary.IS_QUALITY_TYPE and len(premise.fact) == 3
        ]
        subject = f"{measured[0]} " if measured else ""
        yield f"{subject}{' and '.join(reason.checks)}"
    for premise in reason.premises:
        yield from _ends(premise)


def _status_text(fact: Fact) -> str:
    failed = fact[0] == vocabulary.C_STATUS and fact[-1] == text(ComponentStatus.FAILED)
    return f"{local_name(str(fact[1]))} has failed" if failed else fact_text(fact)
