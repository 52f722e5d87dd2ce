"""The forward chainer: all that follows from facts by rules, with the derivation of each conclusion.

Evaluation is semi-naive, a fact at a time. Each fact is entered into the indexes, then triggers the rules that have an
atom for it. They are joined with all facts that were entered earlier. A conclusion waits for its turn in a queue.
Rules create no individuals, so that this ends; arithmetic may create numbers, for which there is a bound on facts.

Rules have no negation. Conclusions from facts that do not change therefore hold in every cycle: ``Program.over``
computes them once, and ``Base.conclude`` adds what follows from one cycle's facts. Nothing is kept from cycle to cycle,
so nothing has to be retracted.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import Atom, Rule, RuleError, rule_text
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.checking import check_rule
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.joins import (
    EVERY,
    Bindings,
    Index,
    Indexes,
    Step,
    Trigger,
    slots_of,
    start_of,
    triggers_of,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Argument, Fact, Term, Var, order_of

MAX_FACTS: Final = 500_000
"""Facts and conclusions together; 1,500 designs have some 30,000."""

NO_TRIGGERS: Final[Sequence[Trigger]] = ()


class TooManyFacts(RuleError):
    """The rules have more conclusions than allowed: arithmetic that feeds itself has no end."""


@dataclass(frozen=True, slots=True)
class Derivation:
    """How a conclusion was found: its rule, and the values of the rule's variables."""

    rule: Rule
    values: tuple[Term, ...]

    def value_of(self) -> Mapping[Var, Term]:
        """Return the values of the rule's variables, by variable."""
        return dict(zip(slots_of(self.rule), self.values, strict=True))

    def premises(self) -> tuple[Fact, ...]:
        """Return the facts that the classes and properties of the rule's body matched."""
        values = self.value_of()
        return tuple(_instance(atom, values) for atom in self.rule.body if isinstance(atom, Atom))


def _instance(atom: Atom, values: Mapping[Var, Term]) -> Fact:
    terms = [values[argument] if isinstance(argument, Var) else argument for argument in atom.arguments]
    predicate = atom.predicate
    return (predicate, terms[0]) if len(terms) == 1 else (predicate, terms[0], terms[1])


class Program:
    """Rules, each compiled once; raises RuleError for a rule without a meaning.

    The order of the rules has no influence: they are sorted by their text.
    """

    def __init__(self, rules: Iterable[Rule], max_facts: int | None = None) -> None:
        self.rules = tuple(sorted(dict.fromkeys(rules), key=lambda rule: (rule_text(rule), repr(rule))))
        self.max_facts = MAX_FACTS if max_facts is None else max_facts
        for rule in self.rules:
            check_rule(rule)
        indexes = Indexes()
        triggers: dict[str, list[Trigger]] = {}
        self.starts: list[tuple[int, Step]] = []
        for number, rule in enumerate(self.rules):
            for predicate, trigger in triggers_of(number, rule, indexes):
                triggers.setdefault(predicate, []).append(trigger)
            if not any(isinstance(atom, Atom) for atom in rule.body):
                self.starts.append((len(slots_of(rule)), start_of(number, rule, indexes)))
        self.triggers = triggers
        self.indexed = indexes.by_predicate()
        self.index_count = len(indexes.numbers)
        self.heads = tuple(_head_of(rule) for rule in self.rules)

    def over(self, facts: Iterable[Fact]) -> Base:
        """Return facts that do not change, with all that follows from them; raises TooManyFacts."""
        run = _Run(self, {}, tuple({} for _ in range(self.index_count)))
        for slots, start in self.starts:
            start([None] * slots, run)
        run.add(facts)
        return Base(self, run.known, run.indexes)

    def conclude(self, facts: Iterable[Fact]) -> Conclusions:
        """Return what follows from facts; raises TooManyFacts."""
        return self.over(()).conclude(facts)


def _head_of(rule: Rule) -> tuple[Callable[[Bindings], Fact], ...]:
    """Return, for each atom of a head, what makes its fact of the values of the rule's variables."""
    slots = slots_of(rule)
    return tuple(_maker(atom.predicate, atom.arguments, slots) for atom in rule.head)


def _maker(predicate: str, arguments: Sequence[Argument], slots: Mapping[Var, int]) -> Callable[[Bindings], Fact]:
    # Some rules have thousands of conclusions in a cycle: the usual forms have no loop over their arguments.
    first, second = arguments[0], arguments[-1]
    if isinstance(first, Var) and len(arguments) == 1:
        one = slots[first]
        return lambda bindings: (predicate, bindings[one])
    if isinstance(first, Var) and isinstance(second, Var):
        one, other = slots[first], slots[second]
        return lambda bindings: (predicate, bindings[one], bindings[other])
    if isinstance(first, Var) and not isinstance(second, Var):
        one, constant = slots[first], second
        return lambda bindings: (predicate, bindings[one], constant)

    def fact(bindings: Bindings) -> Fact:
        terms: list[Any] = [bindings[slots[each]] if isinstance(each, Var) else each for each in arguments]
        return (predicate, *terms)

    return fact


class Base:
    """Facts that do not change, and all that follows from them."""

    def __init__(self, program: Program, known: dict[Fact, Derivation | None], indexes: tuple[Index, ...]) -> None:
        self._program = program
        self._known = known
        self._indexes = indexes
        self._by_predicate = _by_predicate(known)
        self._by_subject: dict[str, dict[Term, list[Fact]]] = {}

    def about(self, predicate: str, subject: Term) -> Sequence[Fact]:
        """Return the facts of a property about a subject; each property's are sorted once."""
        table = self._by_subject.get(predicate)
        if table is None:
            table = self._by_subject[predicate] = {}
            for fact in self._by_predicate.get(predicate, ()):
                table.setdefault(fact[1], []).append(fact)
        return table.get(subject, ())

    def conclude(self, facts: Iterable[Fact] = ()) -> Conclusions:
        """Return what follows when these facts are added for one cycle; raises TooManyFacts."""
        run = _Run(self._program, self._known, self._indexes)
        run.add(facts)
        return Conclusions(self, self._known, run.known, self._by_predicate)


class Conclusions:
    """All facts of one cycle: those given, and those that follow, each with its derivation."""

    def __init__(
        self,
        origin: Base,
        base: Mapping[Fact, Derivation | None],
        run: Mapping[Fact, Derivation | None],
        base_by_predicate: Mapping[str, Sequence[Fact]],
    ) -> None:
        self.origin = origin
        self._base = base
        self._run = run
        self._base_by_predicate = base_by_predicate
        self._run_by_predicate = _by_predicate(run)

    def __contains__(self, fact: Fact) -> bool:
        return fact in self._run or fact in self._base

    def __len__(self) -> int:
        return len(self._base) + len(self._run)

    def derivation(self, fact: Fact) -> Derivation | None:
        """Return how a fact was found, None if it was given; raises KeyError for a fact that does not hold."""
        return self._run[fact] if fact in self._run else self._base[fact]

    def derived(self) -> tuple[Fact, ...]:
        """Return the facts that were not given, in the order in which they were found."""
        known = (*self._base.items(), *self._run.items())
        return tuple(fact for fact, derivation in known if derivation is not None)

    def of(self, predicate: str) -> tuple[Fact, ...]:
        """Return the facts of a class or property, in the order in which they were found."""
        return (*self._base_by_predicate.get(predicate, ()), *self._run_by_predicate.get(predicate, ()))

    def added(self, predicate: str) -> Sequence[Fact]:
        """Return the facts of a class or property that the base does not have."""
        return self._run_by_predicate.get(predicate, ())

    def all(self) -> frozenset[Fact]:
        """Return all facts."""
        return frozenset(self._base) | frozenset(self._run)


def _by_predicate(known: Iterable[Fact]) -> dict[str, list[Fact]]:
    found: dict[str, list[Fact]] = {}
    for fact in known:
        found.setdefault(fact[0], []).append(fact)
    return found


class _Run:
    """One evaluation: what is known, what is indexed, and what waits."""

    def __init__(
        self, program: Program, base: Mapping[Fact, Derivation | None], base_indexes: tuple[Index, ...]
    ) -> None:
        self._program = program
        self._base = base
        self._waiting: deque[Fact] = deque()
        self._room = program.max_facts - len(base)
        self.known: dict[Fact, Derivation | None] = {}
        self.emissions = 0
        self.base_indexes = base_indexes
        self.indexes: tuple[Index, ...] = tuple({} for _ in range(program.index_count))

    def holds(self, fact: Fact) -> bool:
        return fact in self.known or fact in self._base

    def emit(self, rule: int, bindings: Bindings) -> None:
        self.emissions += 1
        derivation: Derivation | None = None
        known, base = self.known, self._base
        for fact_of in self._program.heads[rule]:
            fact = fact_of(bindings)
            if fact in known or fact in base:
                continue
            if derivation is None:
                derivation = Derivation(self._program.rules[rule], tuple(bindings))
            known[fact] = derivation
            self._waiting.append(fact)
            if len(known) > self._room:
                source, most = self._program.rules[rule], self._program.max_facts
                why = f"more than {most} facts; arithmetic that feeds itself has no end"
                raise TooManyFacts(why, source.name, source.file)

    def add(self, facts: Iterable[Fact]) -> None:
        """Add facts and all that follows from them."""
        given = sorted({fact for fact in facts if fact not in self._base}, key=order_of)
        if len(given) > self._room:
            why = f"{len(given)} facts were given, at most {self._program.max_facts} are allowed"
            raise TooManyFacts(why, "none")
        for fact in given:
            self.known[fact] = None
        self._waiting.extend(given)
        waiting, triggers, indexed = self._waiting, self._program.triggers, self._program.indexed
        while waiting:
            fact = waiting.popleft()
            for number, position in indexed.get(fact[0], ()):
                key = fact[position] if position else EVERY
                self.indexes[number].setdefault(key, []).append(fact)
            for trigger in triggers.get(fact[0], NO_TRIGGERS):
                self._fire(trigger, fact)

    def _fire(self, trigger: Trigger, fact: Fact) -> None:
        for position, constant in trigger.constants:
            if fact[position] != constant:
                return
        for number, key in trigger.guards:
            if key not in self.indexes[number] and key not in self.base_indexes[number]:
                return
        bindings: Bindings = [None] * trigger.slots
        for position, slot in trigger.binds:
            bindings[slot] = fact[position]
        for position, slot in trigger.repeats:
            if fact[position] != bindings[slot]:
                return
        trigger.first(bindings, self)
