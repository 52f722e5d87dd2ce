"""Makes the typed view of a knowledge base; what has no meaning there is an error with file, line and individual."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve, curve_of
from regraft.adaptation_manager.planners.metacontrol.knowledge.errors import KnowledgeError, Problem
from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import KnowledgeBase
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import (
    Design,
    Grounding,
    Model,
    Objective,
    Quality,
    Requirement,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.chainer import Conclusions
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Data, Term, local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus, Direction


def model_of(knowledge: KnowledgeBase) -> Model:
    """Return the typed view of a knowledge base; raises KnowledgeError."""
    viewer = _Viewer(knowledge, knowledge.conclude())
    model = viewer.model()
    if viewer.problems:
        raise KnowledgeError(sorted(viewer.problems))
    return model


@dataclass(slots=True)
class _Viewer:
    """Collects what there is, and what is wrong with it."""

    knowledge: KnowledgeBase
    conclusions: Conclusions
    problems: list[Problem] = field(default_factory=list)
    _tables: dict[str, dict[Term, list[Term]]] = field(default_factory=dict)
    _requirers: dict[str, list[str]] = field(default_factory=dict)

    def model(self) -> Model:
        qualities = {name: self._quality(name) for name in self._individuals(vocabulary.QUALITY_TYPE)}
        objectives = {name: self._objective(name) for name in self._individuals(vocabulary.OBJECTIVE)}
        components = {name: self._component(name) for name in self._individuals(vocabulary.COMPONENT)}
        designs = {
            name: design
            for name in self._individuals(vocabulary.DESIGN)
            if (design := self._design(name, objectives)) is not None
        }
        groundings = {
            name: grounding
            for name in self._individuals(vocabulary.GROUNDING)
            if (grounding := self._grounding(name)) is not None
        }
        required = {each.name for design in designs.values() for each in design.requires}
        own = {name: each for name, each in objectives.items() if each is not None and name not in required}
        functions = tuple(self._individuals(vocabulary.FUNCTION))
        return Model(functions, designs, own, groundings, components, qualities)

    def _individuals(self, kind: str) -> list[str]:
        return sorted((str(fact[1]) for fact in self.conclusions.of(kind)), key=self.knowledge.order)

    def _values(self, subject: str, predicate: str) -> list[Term]:
        """Return the values of a property, in the order of the files where they are individuals."""
        table = self._tables.get(predicate)
        if table is None:
            table = self._tables[predicate] = {}
            for fact in self.conclusions.of(predicate):
                table.setdefault(fact[1], []).append(fact[-1])
        return table.get(subject, [])

    def _names(self, subject: str, predicate: str) -> list[str]:
        return sorted(map(str, self._values(subject, predicate)), key=self.knowledge.order)

    def _note(self, individual: str, why: str) -> None:
        self.problems.append(Problem(*self.knowledge.place(individual), f"{local_name(individual)!r}: {why}"))

    def _one(self, subject: str, predicate: str) -> Term | None:
        """Return the value of a property, the first one if there are several and its axiom is missing."""
        values = self._values(subject, predicate)
        if len(values) > 1:
            shown = ", ".join(sorted(local_name(str(value)) for value in values))
            self._note(subject, f"{local_name(predicate)} has {len(values)} values, must have 1: {shown}")
        return values[0] if values else None

    def _number(self, subject: str, predicate: str, default: float) -> float:
        value = self._one(subject, predicate)
        return float(value.value) if isinstance(value, Data) else default

    def _is_true(self, subject: str, predicate: str) -> bool:
        value = self._one(subject, predicate)
        return isinstance(value, Data) and value.value is True

    def _quality(self, name: str) -> Quality:
        direction = self._one(name, vocabulary.DIRECTION)
        lowest, highest = self._number(name, vocabulary.LOWEST, 0.0), self._number(name, vocabulary.HIGHEST, 1.0)
        if lowest > highest:
            self._note(name, f"the lowest value is {lowest:g}, must be at most the highest, {highest:g}")
        weight = self._number(name, vocabulary.WEIGHT, 0.0)
        if weight < 0:
            self._note(name, f"the weight is {weight:g}, must be at least 0")
        curve = self._curve(name)
        if weight and direction is None and curve is None:
            self._note(name, "has a weight and no qa_direction, which must be HIGHER or LOWER")
        known = Direction(str(direction.value)) if isinstance(direction, Data) else None
        return Quality(name, known, weight, lowest, highest, curve)

    def _curve(self, name: str) -> Curve | None:
        value = self._one(name, vocabulary.CURVE)
        if not isinstance(value, Data):
            return None
        try:
            return curve_of(str(value.value))
        except ValueError as error:
            self._note(name, f"qa_curve: {error}")
            return None

    def _component(self, name: str) -> ComponentStatus:
        status = self._one(name, vocabulary.C_STATUS)
        return ComponentStatus(str(status.value)) if isinstance(status, Data) else ComponentStatus.AVAILABLE

    def _qualities_of(self, subject: str, predicate: str) -> Mapping[str, float]:
        """Return values by quality; noted is a quality with different values, or a value without a type."""
        found: dict[str, float] = {}
        for each in self._names(subject, predicate):
            quality, value = self._one(each, vocabulary.IS_QUALITY_TYPE), self._one(each, vocabulary.HAS_VALUE)
            if quality is None:
                self._note(each, "has no isQAtype, must have 1")
            elif not isinstance(value, Data):
                self._note(each, "has no hasValue, must have 1 number")
            elif found.setdefault(str(quality), float(value.value)) != value.value:
                kept, short = found[str(quality)], local_name(str(quality))
                self._note(subject, f"the quality {short!r} has the values {kept:g} and {value.value:g}, must have 1")
        return found

    def _objective(self, name: str) -> Objective | None:
        function = self._one(name, vocabulary.TYPE_F)
        if function is None:
            self._note(name, "has no typeF, must name the function that it is for")
            return None
        bounds = self._qualities_of(name, vocabulary.HAS_NFR)
        return Objective(
            name,
            str(function),
            tuple(Requirement(quality, bound) for quality, bound in bounds.items()),
            self._number(name, vocabulary.PRIORITY, 0.0),
            self._is_true(name, vocabulary.ALWAYS_IMPROVE),
        )

    def _design(self, name: str, objectives: Mapping[str, Objective | None]) -> Design | None:
        function = self._one(name, vocabulary.SOLVES_F)
        if function is None:
            self._note(name, "has no solvesF, must name the function that it solves")
            return None
        context = self._one(name, vocabulary.CONTEXT)
        requires = [objectives.get(each) for each in self._names(name, vocabulary.DESIGN_REQUIRES_O)]
        return Design(
            name,
            str(function),
            self._qualities_of(name, vocabulary.HAS_ESTIMATE),
            tuple(self._components_of(name)),
            tuple(each for each in requires if each is not None),
            str(context.value) if isinstance(context, Data) else vocabulary.DEFAULT_CONTEXT,
            self._is_true(name, vocabulary.IS_REST),
        )

    def _components_of(self, design: str) -> list[str]:
        if not self._requirers:
            for fact in self.conclusions.of(vocabulary.REQUIRED_BY):
                self._requirers.setdefault(str(fact[-1]), []).append(str(fact[1]))
        required = self._requirers.get(design, [])
        roles = self._names(design, vocabulary.ROLES)
        in_roles = [specified for role in roles for specified in self._names(role, vocabulary.ROLE_DEF)]
        return sorted({*required, *in_roles}, key=self.knowledge.order)

    def _grounding(self, name: str) -> Grounding | None:
        design, objective = self._one(name, vocabulary.TYPE_FD), self._one(name, vocabulary.SOLVES_O)
        if design is None or objective is None:
            self._note(name, f"has no {'typeFD' if design is None else 'solvesO'}, must have 1")
            return None
        return Grounding(name, str(objective), str(design), tuple(self._names(name, vocabulary.REQUIRES_O)))
