"""Individuals for an ontology in TOMASys' and MROS' terms, as RDF/XML (paper, sections II-B and IV).

A realization is a design that solves its skill, with a value for each quality that it estimates. Observable components
that are active in it are required by it. The text has one assertion a line.

A reasoner needs more than was published. Of qualities these are the direction, weight, range and curve. Of designs
these are the context, the mark of rest and the required objectives. They are terms of MROS' namespace, and counted
apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import quote
from xml.sax.saxutils import quoteattr

from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve
from regraft.adaptation_manager.planners.metacontrol.skills.generators.naming import Names, qualified
from regraft.adaptation_manager.planners.metacontrol.skills.generators.rdf_lines import (
    OWL,
    PUBLISHED,
    RDF,
    Namespaces,
    element,
    number,
    resource,
    text,
    truth,
    without_mark,
)
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import (
    choosable,
    expected,
    is_realisable,
    is_rest,
    observed,
)
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import (
    Better,
    QualityType,
    Realization,
    Requirement,
    SkillSet,
)

OWN: Final = ("fd_context", "fd_is_rest", "fd_requiresO")
"""Properties of designs that the published files have not, in MROS' namespace."""
DIRECTIONS: Final = {Better.HIGHER: "HIGHER", Better.LOWER: "LOWER"}


@dataclass(frozen=True, slots=True)
class Individuals:
    """An ontology of individuals.

    ``designs`` are the realizations that may be chosen, each with the IRI of its design; ``rests`` are configurations
    of rest. ``owners`` has such an IRI for each line that a published file would have for the design. It is empty for
    all other lines.
    """

    lines: tuple[str, ...]
    owners: tuple[str, ...]
    designs: tuple[tuple[Realization, str], ...]
    rests: tuple[tuple[Realization, str], ...]
    namespaces: Namespaces

    @property
    def text(self) -> str:
        """The ontology as RDF/XML."""
        return "\n".join([*self.lines, ""])


def individuals(skills: SkillSet, namespaces: Namespaces = PUBLISHED) -> Individuals:
    """Return the individuals of skills, the same for the same skills."""
    writer = _Writer(skills, namespaces)
    lines = tuple(writer.lines())
    designs, rests = (
        tuple((each, f"{namespaces.domain}{name}") for each, name in given.items())
        for given in (writer.designs, writer.rests)
    )
    owners = tuple(f"{namespaces.domain}{owner}" if owner else "" for _, owner in lines)
    return Individuals(tuple(line for line, _ in lines), owners, designs, rests, namespaces)


Line = tuple[str, str]


class _Writer:
    def __init__(self, skills: SkillSet, namespaces: Namespaces) -> None:
        self._skills = skills
        self._namespaces = namespaces
        self._observed = observed(skills)
        # A skill or component may be named like a realization. Individuals may not: their classes are disjoint.
        self._names = Names([*(each.name for each in skills.skills), *self._observed])
        self.designs = qualified(choosable(skills), self._names)
        resting = [each for each in skills.realizations if is_rest(each) and is_realisable(each) and each.skill]
        self.rests = qualified(resting, self._names)

    def lines(self) -> Iterator[Line]:
        """Yield all lines, each with the design whose it is, empty for none."""
        yield from self._shared(self._head())
        for realization, name in self.designs.items():
            yield from self._design(realization, name)
        for realization, name in self.rests.items():
            yield from self._shared(self._rest(realization, name))
        yield from self._components()
        yield "</rdf:RDF>", ""

    @staticmethod
    def _shared(lines: Iterator[str]) -> Iterator[Line]:
        return ((line, "") for line in lines)

    def _head(self) -> Iterator[str]:
        given = self._namespaces
        stem = quote(Path(self._skills.file).stem, safe="")
        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield f'<rdf:RDF xmlns:rdf="{RDF}"'
        yield f'    xmlns:owl="{OWL}"'
        yield f"    xmlns:tomasys={quoteattr(given.tomasys)}"
        yield f"    xmlns:mros={quoteattr(given.mros)}>"
        imports = resource("owl:imports", without_mark(given.mros))
        yield from element("owl:Ontology", f"{without_mark(given.domain)}/{stem}", imports)
        for skill in self._skills.skills:
            yield from element("tomasys:Function", given.domain + skill.name)
        types = {each.name: each for each in self._skills.qualities}
        listed = (each.text for skill in self._skills.skills for each in skill.qualities)
        for quality in dict.fromkeys((*listed, *types)):
            known = _declared(types[quality]) if quality in types else ()
            yield from element("tomasys:QualityAttributeType", given.mros + quality, *known)

    def _design(self, realization: Realization, name: str) -> Iterator[Line]:
        given = self._namespaces
        estimates = expected(realization)
        values = {each: self._names.take(f"qa_{each}_{name}") for each in sorted(estimates)}
        objectives = {self._names.take(f"{name}_requires_{each.skill}"): each for each in realization.requirements}
        begin, *published, end = element(
            "tomasys:FunctionDesign",
            given.domain + name,
            resource("tomasys:solvesF", given.domain + realization.skill),
            *(resource("tomasys:hasQAestimation", given.domain + value) for value in values.values()),
        )
        yield from ((line, name) for line in (begin, *published))
        yield text("mros:fd_context", realization.context.text), ""
        yield from ((resource("mros:fd_requiresO", given.domain + each), "") for each in objectives)
        yield end, name
        for quality, value in values.items():
            yield from ((line, name) for line in self._value(value, quality, estimates[quality]))
        for each, requirement in objectives.items():
            yield from self._shared(self._objective(each, requirement))

    def _value(self, name: str, quality: str, value: float) -> list[str]:
        given = self._namespaces
        kind = resource("tomasys:isQAtype", given.mros + quality)
        return element("tomasys:QAvalue", given.domain + name, kind, number("tomasys:hasValue", value))

    def _objective(self, name: str, requirement: Requirement) -> Iterator[str]:
        """Yield the objective of a skill that a design requires, with its bounds."""
        given = self._namespaces
        bounds = {self._names.take(f"qa_{each.quality}_{name}"): each for each in requirement.bounds}
        function = resource("tomasys:typeF", given.domain + requirement.skill)
        wanted = (resource("tomasys:hasNFR", given.domain + each) for each in bounds)
        yield from element("tomasys:Objective", given.domain + name, function, *wanted)
        for each, bound in bounds.items():
            yield from self._value(each, bound.quality, bound.value)

    def _rest(self, realization: Realization, name: str) -> Iterator[str]:
        domain = self._namespaces.domain
        yield from element(
            "tomasys:FunctionDesign",
            domain + name,
            resource("tomasys:solvesF", domain + realization.skill),
            text("mros:fd_context", realization.context.text),
            truth("mros:fd_is_rest", True),
        )

    def _components(self) -> Iterator[Line]:
        domain = self._namespaces.domain
        required = self._required()
        for name in self._observed:
            below = {resource("mros:requiredBy", domain + design): design for design in required[name]}
            for line in element("tomasys:Component", domain + name, *below):
                yield line, below.get(line, "")

    def _required(self) -> dict[str, list[str]]:
        """Return the designs in which each observable component is active."""
        found: dict[str, list[str]] = {name: [] for name in self._observed}
        for realization, design in self.designs.items():
            for each in realization.components:
                if each.is_active and each.name in found:
                    found[each.name].append(design)
        return found


def _declared(quality: QualityType) -> Iterator[str]:
    """Yield what a quality is declared to be; what is left out is not stated."""
    yield text("mros:qa_direction", DIRECTIONS[quality.better])
    given = (("mros:qa_weight", quality.weight), ("mros:qa_lowest", quality.low), ("mros:qa_highest", quality.high))
    yield from (number(name, value) for name, value in given if value is not None)
    if quality.curve is not None:
        yield text("mros:qa_curve", str(Curve(quality.curve)))
