"""The rule engine concludes what Pellet concludes: random knowledge bases, comparisons included.

Pellet runs in Java, by owlready2 before 0.50 (later versions need Java 25): the extra ``oracle``.
"""

from __future__ import annotations

import random
import shutil
import statistics
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.knowledge_base import LEVELS, load, snapshot
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Objective, Requirement
from regraft.adaptation_manager.planners.metacontrol.knowledge.owl.rdf_xml import write_rdf_xml
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Data
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser
from regraft.adaptation_manager.planners.metacontrol.reasoning.design_selection import plan
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Resting
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation, facts_of
from regraft.adaptation_manager.planners.metacontrol.skills.generators.owl import individuals
from regraft.adaptation_manager.planners.metacontrol.skills.reading import LIBRARY, read_skills
from tests.metacontrol.owl import APPLICATION, individual, iri, rule, write

pytestmark = [
    pytest.mark.evidence,
    pytest.mark.timeout(3600),
    pytest.mark.skipif(shutil.which("java") is None, reason="there is no Java, which runs Pellet"),
    pytest.mark.filterwarnings("ignore"),
]

BASES = 200
TOGETHER = 20
"""Bases of one run of Pellet, which takes seconds to start; they share no name."""

NUMBERS = ("0.5", "1.0", "1.5", "2.0")
COMPARISONS = ("equal", "notEqual", "lessThan", "lessThanOrEqual", "greaterThan", "greaterThanOrEqual")
DECLARED = (("owl:Class", "AB"), ("owl:ObjectProperty", "pq"), ("owl:DatatypeProperty", "de"))


class Chance:
    """Draws one knowledge base; all its names end with its number."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.random = random.Random(number)
        self.individuals = [f"i{index}_{number}" for index in range(4)]

    def parts(self) -> Iterator[str]:
        """Yield declarations, individuals and rules."""
        for element, names in DECLARED:
            for name in names:
                yield f'<{element} rdf:about="{iri(self.name(name))}"/>\n'
        yield '<owl:AllDifferent><owl:distinctMembers rdf:parseType="Collection">\n'
        yield "".join(f'<owl:NamedIndividual rdf:about="{iri(name)}"/>\n' for name in self.individuals)
        yield "</owl:distinctMembers></owl:AllDifferent>\n"
        for name in self.individuals:
            values: dict[str, object] = {f"app__{self.name(each)}": self._linked() for each in "pq"}
            values |= {f"app__{self.name(each)}": self._numbers() for each in "de"}
            yield individual(name, self.name(self.random.choice("AB")), **values)
        for index in range(self.random.randint(2, 5)):
            yield self._rule(f"rule {index} of {self.number}")

    def name(self, short: str) -> str:
        """Return a name of this base."""
        return f"{short}_{self.number}"

    def _linked(self) -> list[str]:
        return [f">{name}" for name in self.random.sample(self.individuals, self.random.randint(0, 2))]

    def _numbers(self) -> list[float]:
        return [float(number) for number in self.random.sample(NUMBERS, self.random.randint(0, 2))]

    def _thing(self, pool: list[str]) -> str:
        return self.random.choice([*pool, *pool, f"app:{self.random.choice(self.individuals)}"])

    def _atom(self, things: list[str], values: list[str]) -> str:
        kind = self.random.choice("cpd")
        if kind == "c":
            return f"app:{self.name(self.random.choice('AB'))} {self._thing(things)}"
        if kind == "p":
            return f"app:{self.name(self.random.choice('pq'))} {self._thing(things)} {self._thing(things)}"
        value = self.random.choice([*values, *values, self.random.choice(NUMBERS)])
        return f"app:{self.name(self.random.choice('de'))} {self._thing(things)} {value}"

    def _body(self) -> list[str]:
        """Return atoms in which Pellet does not break: it raises for those without variables, or with one twice."""
        size, body = self.random.randint(1, 3), list[str]()
        while len(body) < size:
            atom = self._atom(["?x", "?y", "?z"], ["?v", "?w"])
            names = [word for word in atom.split() if word.startswith("?")]
            if names and len(names) == len(set(names)) and atom not in body:
                body.append(atom)
        return body

    def _rule(self, label: str) -> str:
        body = self._body()
        used = {word for atom in body for word in atom.split() if word.startswith("?")}
        things, values = sorted(used & {"?x", "?y", "?z"}), sorted(used & {"?v", "?w"})
        if len(things) > 1 and self.random.random() < 0.3:
            body.append(f"{self.random.choice(['sameAs', 'differentFrom'])} {things[0]} {things[1]}")
        if values and self.random.random() < 0.7:
            other = self.random.choice([values[-1], self.random.choice(NUMBERS)])
            body.append(f"swrlb:{self.random.choice(COMPARISONS)} {values[0]} {other}")
        head = [self._atom(things, values) for _ in range(self.random.randint(1, 2))]
        return rule(label, body, head)


def by_pellet(owlready: Any, file: Path) -> set[tuple[object, ...]]:
    """Return the facts that Pellet concludes from a file."""
    world = owlready.World()
    ontology = world.get_ontology(file.as_uri()).load()
    with ontology:
        owlready.sync_reasoner_pellet(world, infer_property_values=True, infer_data_property_values=True, debug=0)
    found: set[tuple[object, ...]] = set()
    for each in world.individuals():
        found |= {(kind.name, each.name) for kind in each.is_a if getattr(kind, "iri", "").startswith(APPLICATION)}
        for prop in each.get_properties():
            for value in prop[each]:
                found.add((prop.name, each.name, value.name if hasattr(value, "name") else float(value)))
    return found


def by_chainer(file: Path) -> set[tuple[object, ...]]:
    """Return the facts that the rule engine concludes from a file."""
    found: set[tuple[object, ...]] = set()
    for fact in load([file]).conclude().all():
        terms = (term.value if isinstance(term, Data) else term.removeprefix(APPLICATION) for term in fact[1:])
        if fact[0].startswith(APPLICATION):
            found.add((fact[0].removeprefix(APPLICATION), *terms))
    return found


def test_two_hundred_random_bases_have_the_conclusions_of_pellet(tmp_path: Path) -> None:
    owlready = pytest.importorskip("owlready2", reason="owlready2 is not installed: pip install 'owlready2<0.50'")
    stated = concluded = 0
    for start in range(0, BASES, TOGETHER):
        parts = [part for number in range(start, start + TOGETHER) for part in Chance(number).parts()]
        file = write(tmp_path, *parts, name=f"bases_{start}.owl", ontology=f"http://bases/{start}", imports=())
        mine, oracle = by_chainer(file), by_pellet(owlready, file)
        assert sorted(map(str, mine - oracle)) == [], "concluded here alone"
        assert sorted(map(str, oracle - mine)) == [], "concluded by Pellet alone"
        conclusions = load([file]).conclude()
        stated += len(conclusions) - len(conclusions.derived())
        concluded += len(conclusions.derived())
    print(f"{BASES} bases: {stated} facts stated, {concluded} concluded, equal to Pellet's")
    assert concluded > BASES


FASTER = 1000
"""How many decisions are made in the time of one by Pellet, at the least."""
REPEATS = 3


def seconds_of(call: Callable[[], object], repeats: int) -> float:
    """Return the median of the seconds that a call takes."""
    taken = []
    for _ in range(repeats):
        begun = time.perf_counter()
        call()
        taken.append(time.perf_counter() - begun)
    return statistics.median(taken)


def test_a_thousand_decisions_take_less_than_one_of_pellet(tmp_path: Path) -> None:
    owlready = pytest.importorskip("owlready2", reason="owlready2 is not installed: pip install 'owlready2<0.50'")
    made = tmp_path / "individuals.owl"
    made.write_text(individuals(read_skills(LIBRARY / "navigation.skills")).text)
    knowledge = load([*LEVELS, made])
    analyser, resting = Analyser(knowledge), Resting()
    model = analyser.model
    bounds = tuple(Requirement(model.find("quality", name), 0.5) for name in ("safety", "energy"))
    function, laser = model.find("function", "to_navigate"), model.find("component", "laser_resender")
    objectives = tuple(Objective(f"patrol_{index}", function, bounds) for index in range(5))
    situation = Situation(objectives, components=dict(model.components) | {laser: ComponentStatus.FAILED})
    whole = tmp_path / "whole.owl"
    whole.write_bytes(write_rdf_xml(snapshot(knowledge, facts_of(model, situation))))

    def decide() -> None:
        plan(model, situation, analyser.analyse(situation), resting, 0.0)

    def conclude() -> None:
        world = owlready.World()
        with world.get_ontology(whole.as_uri()).load():
            owlready.sync_reasoner_pellet(world, infer_property_values=True, infer_data_property_values=True, debug=0)

    decide()
    ours, theirs = seconds_of(decide, 200), seconds_of(conclude, REPEATS)
    print(f"a decision takes {ours * 1e3:.2f} ms, Pellet {theirs:.2f} s: {theirs / ours:.0f} times as long")
    assert theirs >= FASTER * ours
