"""The designs that a decision was made from: each is assessed when it is asked for, as it was at that time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Design, Objective, Quality, Requirement
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analysis
from regraft.adaptation_manager.planners.metacontrol.reasoning.assessment import (
    Against,
    Assessment,
    Objection,
    causes,
)
from regraft.adaptation_manager.planners.metacontrol.reasoning.ranking import Ranking
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Rest


@dataclass(slots=True)
class Considered:
    """The designs that were considered for an objective.

    ``rests`` are the rests of ``now``, by design. ``tried`` are candidates that could not be taken, and why.
    ``unavailable`` are designs that the system cannot enter as it is, and why.
    """

    objective: Objective
    ranking: Ranking
    qualities: Mapping[str, Quality]
    analysis: Analysis
    rests: Mapping[str, Rest]
    now: float
    present: str | None
    unavailable: Mapping[str, str] = field(default_factory=dict)
    selected: str | None = None
    tried: dict[str, Objection] = field(default_factory=dict)

    def candidates(self) -> list[str]:
        """Return the designs against which nothing speaks, the most useful first; of equal ones the present one."""
        failed = {design for design, objective in self.analysis.failed if objective == self.objective.name}
        out = failed | self.rests.keys() | self.unavailable.keys()
        unrealisable = self.analysis.unrealisable
        found = [name for name in self.ranking.fitting if name not in unrealisable and name not in out]
        if self.present in found:
            found.remove(self.present)
            utilities = self.ranking.utilities
            least = utilities[self.present]
            place = next((index for index, name in enumerate(found) if utilities[name] <= least), len(found))
            found.insert(place, self.present)
        return found

    def kinds(self) -> frozenset[Against]:
        """Return the kinds of what speaks against the designs; an unmet requirement stands for a missing estimate."""
        found = {objection.kind for objection in self.tried.values()}
        designs = self.ranking.utilities.keys()
        if not (self.analysis.unrealisable | self.unavailable.keys()).isdisjoint(designs):
            found.add(Against.UNREALISABLE)
        if any(design in designs and name == self.objective.name for design, name in self.analysis.failed):
            found.add(Against.FAILED)
        if not self.rests.keys().isdisjoint(designs):
            found.add(Against.RESTING)
        if len(self.ranking.fitting) < len(self.ranking.designs):
            found.add(Against.REQUIREMENT)
        return frozenset(found)

    def required_statuses(self) -> frozenset[Status]:
        """Return the statuses of required objectives that have no design."""
        return frozenset(each.status for each in self.tried.values() if each.status is not None)

    def assessments(self) -> Iterator[Assessment]:
        """Yield the assessment of each design, in the order of the files."""
        for design in self.ranking.designs:
            assessment = self._assess(design)
            if design.name in self.tried:
                assessment = assessment.with_objection(self.tried[design.name])
            elif self.selected is not None and not assessment.against and design.name != self.selected:
                assessment = assessment.with_objection(self._less_useful(assessment.utility, self.selected))
            yield replace(assessment, is_selected=design.name == self.selected)

    def _assess(self, design: Design) -> Assessment:
        met: list[str] = []
        against = list(self._against(design.name))
        for requirement in self.objective.requirements:
            text, kind = self._required(design, requirement)
            if kind is None:
                met.append(text)
            else:
                against.append(Objection(kind, text))
        utility = self.ranking.utility
        return Assessment(
            design.name,
            self.ranking.utilities[design.name],
            utility.parts(design),
            utility.missing(design),
            tuple(met),
            tuple(against),
            design.name == self.present,
            curves={each.quality: each.curve for each in utility.shares if each.curve is not None},
        )

    def _against(self, design: str) -> Iterator[Objection]:
        analysis, objective = self.analysis, self.objective.name
        if design in analysis.unrealisable:
            yield Objection(
                Against.UNREALISABLE, lambda: f"not realisable: {causes(analysis.why_unrealisable(design))}"
            )
        if design in self.unavailable:
            yield Objection(Against.UNREALISABLE, f"not realisable: {self.unavailable[design]}")
        if (design, objective) in analysis.failed:
            yield Objection(Against.FAILED, lambda: f"it fails now: {causes(analysis.why_failed(design, objective))}")
        if design in self.rests:
            rest = self.rests[design]
            yield Objection(Against.RESTING, f"it rests for {rest.until - self.now:.3g} s: {rest.why}")

    def _required(self, design: Design, requirement: Requirement) -> tuple[str, Against | None]:
        """Return how a design meets a requirement, and what speaks against it if it does not."""
        quality, short = self.qualities[requirement.quality], local_name(requirement.quality)
        bound = f"{quality.sign} {requirement.bound:g}"
        if requirement.quality not in design.estimates:
            return f"no estimate of {short}, which must be {bound}", Against.NO_ESTIMATE
        value = design.estimates[requirement.quality]
        if quality.meets(value, requirement.bound):
            return f"{short} is estimated {value:g}, {bound}", None
        return f"{short} is estimated {value:g}, must be {bound}", Against.REQUIREMENT

    def _less_useful(self, utility: float, selected: str) -> Objection:
        short, best = local_name(selected), self.ranking.utilities[selected]
        if utility > best:
            state = "the present design" if selected == self.present else "the design asked for"
            why = f"{short} is {state}, and was kept"
        elif utility == best:
            why = f"it is as useful as {short}, which is present or stands before it"
        else:
            why = f"{short} is more useful: {best:.4g}"
        return Objection(Against.LESS_USEFUL, why)
