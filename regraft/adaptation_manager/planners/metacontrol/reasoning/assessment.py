"""Reasons for and against a design: realisability, rest, requirements and utility, as data and as text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from regraft.adaptation_manager.planners.metacontrol.knowledge import names
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Design, Objective, Quality
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.explanation import Reason
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import fact_text, local_name
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analysis
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Resting
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
    """One thing that speaks against a design. ``holder`` is the objective to which a clashing design belongs."""

    kind: Against
    why: str
    holder: str = ""


@dataclass(frozen=True, slots=True)
class Assessment:
    """Reasons for and against a design.

    ``parts`` are the qualities' shares of the utility. ``missing`` are qualities without an estimate, which count with
    their worst values. ``met`` are requirements that the estimates meet, as text.
    """

    design: str
    utility: float
    parts: Mapping[str, float]
    missing: tuple[str, ...]
    met: tuple[str, ...]
    against: tuple[Objection, ...]
    is_present: bool = False
    is_selected: bool = False

    def with_objection(self, objection: Objection) -> Assessment:
        """Return the same assessment with one more objection."""
        return replace(self, against=(*self.against, objection))

    def lines(self) -> Iterator[str]:
        """Yield the assessment as lines of text."""
        state = "selected" if self.is_selected else "not selected"
        yield f"{local_name(self.design)}: {state}{', present' if self.is_present else ''}, utility {self.utility:.4g}"
        for name, share in self.parts.items():
            yield f"  {local_name(name)}: {share:+.4g} of the utility"
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
        return {
            "design": self.design,
            "selected": self.is_selected,
            "present": self.is_present,
            "utility": self.utility,
            "parts": dict(self.parts),
            "missing": list(self.missing),
            "for": list(self.met),
            "against": against,
        }


def utility_of(
    design: Design, objective: Objective, qualities: Mapping[str, Quality]
) -> tuple[float, dict[str, float], tuple[str, ...]]:
    """Return the utility of a design, each quality's share, and the qualities without an estimate.

    The utility is the weighted sum of the estimates, those of which less is better with a negative sign. A quality
    without an estimate counts with its worst value. The objective's weights come before those of the qualities.
    """
    weights = objective.weights
    if weights is None:
        weights = {name: quality.weight for name, quality in qualities.items()}
    parts: dict[str, float] = {}
    missing: list[str] = []
    for name, weight in weights.items():
        quality = qualities[name]
        if not weight or quality.direction is None:
            continue
        if name not in design.estimates:
            missing.append(name)
        value = design.estimates.get(name, quality.worst)
        parts[name] = -weight * value if quality.direction == "LOWER" else weight * value
    return sum(parts.values()), parts, tuple(missing)


def assess(
    design: Design,
    objective: Objective,
    qualities: Mapping[str, Quality],
    analysis: Analysis,
    resting: Resting,
    now: float,
    *,
    is_present: bool,
) -> Assessment:
    """Return what speaks for and against a design by itself, regardless of other objectives."""
    utility, parts, missing = utility_of(design, objective, qualities)
    met: list[str] = []
    against: list[Objection] = []
    if design.name in analysis.unrealisable:
        if design.name not in analysis.texts:
            analysis.texts[design.name] = _causes(analysis.why_unrealisable(design.name))
        against.append(Objection(Against.UNREALISABLE, f"not realisable: {analysis.texts[design.name]}"))
    if analysis.failed and (design.name, objective.name) in analysis.failed:
        failure = analysis.why_failed(design.name, objective.name)
        against.append(Objection(Against.FAILED, f"it fails now: {_causes(failure)}"))
    rest = resting.get(design.name, objective.name, now)
    if rest is not None:
        against.append(Objection(Against.RESTING, f"it rests for {rest.until - now:.3g} s: {rest.why}"))
    for requirement in objective.requirements:
        quality, short = qualities[requirement.quality], local_name(requirement.quality)
        bound = f"{quality.sign} {requirement.bound:g}"
        if requirement.quality not in design.estimates:
            why = f"no estimate of {short}, which must be {bound}"
            against.append(Objection(Against.NO_ESTIMATE, why))
            continue
        value = design.estimates[requirement.quality]
        if quality.meets(value, requirement.bound):
            met.append(f"{short} is estimated {value:g}, {bound}")
        else:
            against.append(Objection(Against.REQUIREMENT, f"{short} is estimated {value:g}, must be {bound}"))
    return Assessment(design.name, utility, parts, missing, tuple(met), tuple(against), is_present)


def _causes(reason: Reason | None) -> str:
    """Return what a conclusion rests on: the comparisons and statuses at the ends of its tree."""
    if reason is None:
        return "by the rules"
    found = list(dict.fromkeys(_ends(reason)))
    return f"{', '.join(found) or fact_text(reason.fact)} (rule {reason.rule or 'none: it was stated'})"


STATUSES = frozenset({names.C_STATUS, names.FG_ERROR, names.CC_AVAILABILITY, names.CSPEC_AVAILABILITY})


def _ends(reason: Reason) -> Iterator[str]:
    if not reason.premises and reason.fact[0] in STATUSES:
        yield fact_text(reason.fact)
    if reason.checks:
        measured = [
            local_name(str(premise.fact[2]))
            for premise in reason.premises
            if premise.fact[0] == names.IS_QUALITY_TYPE and len(premise.fact) == 3
        ]
        subject = f"{measured[0]} " if measured else ""
        yield f"{subject}{' and '.join(reason.checks)}"
    for premise in reason.premises:
        yield from _ends(premise)
