"""Individuals for an ontology in TOMASys' and MROS' terms, as RDF/XML (paper, sections II-B and IV).

A realization is a design that solves its skill, with a value for each quality that it estimates. Observable components
that are active in it are required by it. The text has one assertion a line.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Final
from urllib.parse import quote
from xml.sax.saxutils import quoteattr

from regraft.adaptation_manager.planners.metacontrol.skills.generators.naming import Names, qualified
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import choosable, expected, observed
from regraft.adaptation_manager.planners.metacontrol.skills.model import Realization, SkillSet

RDF: Final = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
OWL: Final = "http://www.w3.org/2002/07/owl#"
DECIMAL: Final = "http://www.w3.org/2001/XMLSchema#decimal"


@dataclass(frozen=True, slots=True)
class Namespaces:
    """The namespaces of the terms and of the individuals; by default the published ones."""

    tomasys: str = "http://metacontrol.org/tomasys#"
    mros: str = "http://ros/mros#"
    domain: str = "http://ros/navigation_domain#"


PUBLISHED: Final = Namespaces()


@dataclass(frozen=True, slots=True)
class Individuals:
    """An ontology of individuals.

    ``designs`` are the realizations in it, each with the IRI of its design. ``owners`` has such an IRI for each line,
    empty for lines that several share.
    """

    lines: tuple[str, ...]
    owners: tuple[str, ...]
    designs: tuple[tuple[Realization, str], ...]

    @property
    def text(self) -> str:
        """The ontology as RDF/XML."""
        return "\n".join([*self.lines, ""])


def individuals(skills: SkillSet, namespaces: Namespaces = PUBLISHED) -> Individuals:
    """Return the individuals of skills, the same for the same skills."""
    writer = _Writer(skills, namespaces)
    lines = tuple(writer.lines())
    designs = tuple((each, f"{namespaces.domain}{name}") for each, name in writer.designs)
    owners = tuple(f"{namespaces.domain}{owner}" if owner else "" for _, owner in lines)
    return Individuals(tuple(text for text, _ in lines), owners, designs)


Line = tuple[str, str]


class _Writer:
    def __init__(self, skills: SkillSet, namespaces: Namespaces) -> None:
        self._skills = skills
        self._namespaces = namespaces
        self._observed = observed(skills)
        # A skill or component may be named like a realization. Individuals may not: their classes are disjoint.
        self._names = Names([*(each.name for each in skills.skills), *self._observed])
        self.designs = tuple(qualified(choosable(skills), self._names).items())

    def lines(self) -> Iterator[Line]:
        """Yield all lines, each with the design whose it is, empty for none."""
        yield from ((text, "") for text in self._head())
        for realization, name in self.designs:
            yield from ((text, name) for text in self._design(realization, name))
        required = self._required()
        for name in self._observed:
            if not required.get(name):
                yield f"  <tomasys:Component {self._about(name)}/>", ""
                continue
            yield f"  <tomasys:Component {self._about(name)}>", ""
            for design in required[name]:
                yield f"    <mros:requiredBy {self._resource(self._namespaces.domain, design)}/>", design
            yield "  </tomasys:Component>", ""
        yield "</rdf:RDF>", ""

    def _head(self) -> Iterator[str]:
        given = self._namespaces
        stem = quote(Path(self._skills.file).stem, safe="")
        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield f'<rdf:RDF xmlns:rdf="{RDF}"'
        yield f'    xmlns:owl="{OWL}"'
        yield f"    xmlns:tomasys={quoteattr(given.tomasys)}"
        yield f"    xmlns:mros={quoteattr(given.mros)}>"
        yield f"  <owl:Ontology rdf:about={quoteattr(f'{_without_mark(given.domain)}/{stem}')}>"
        yield f"    <owl:imports rdf:resource={quoteattr(_without_mark(given.mros))}/>"
        yield "  </owl:Ontology>"
        for skill in self._skills.skills:
            yield f"  <tomasys:Function {self._about(skill.name)}/>"
        listed = dict.fromkeys(each.text for skill in self._skills.skills for each in skill.qualities)
        for quality in listed:
            yield f"  <tomasys:QualityAttributeType rdf:about={quoteattr(given.mros + quality)}/>"

    def _design(self, realization: Realization, name: str) -> Iterator[str]:
        given = self._namespaces
        estimates = expected(realization)
        values = {each: self._names.take(f"qa_{each}_{name}") for each in sorted(estimates)}
        yield f"  <tomasys:FunctionDesign {self._about(name)}>"
        yield f"    <tomasys:solvesF {self._resource(given.domain, realization.skill)}/>"
        for value in values.values():
            yield f"    <tomasys:hasQAestimation {self._resource(given.domain, value)}/>"
        yield "  </tomasys:FunctionDesign>"
        for quality, value in values.items():
            yield f"  <tomasys:QAvalue {self._about(value)}>"
            yield f"    <tomasys:isQAtype {self._resource(given.mros, quality)}/>"
            number = _decimal(estimates[quality])
            yield f'    <tomasys:hasValue rdf:datatype="{DECIMAL}">{number}</tomasys:hasValue>'
            yield "  </tomasys:QAvalue>"

    def _required(self) -> dict[str, list[str]]:
        """Return the designs in which each observable component is active."""
        found: dict[str, list[str]] = {name: [] for name in self._observed}
        for realization, design in self.designs:
            for each in realization.components:
                if each.is_active and each.name in found:
                    found[each.name].append(design)
        return found

    def _about(self, name: str) -> str:
        return f"rdf:about={quoteattr(self._namespaces.domain + name)}"

    @staticmethod
    def _resource(namespace: str, name: str) -> str:
        return f"rdf:resource={quoteattr(namespace + name)}"


def _without_mark(namespace: str) -> str:
    return namespace.rstrip("#/")


def _decimal(value: float) -> str:
    """Return a number as xsd:decimal has it, without an exponent."""
    return format(Decimal(repr(value)), "f")
