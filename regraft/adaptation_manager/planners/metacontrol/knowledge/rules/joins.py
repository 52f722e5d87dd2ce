"""Join plans: a rule is compiled once for each of its atoms, as what to do when a fact matches that atom.

A plan is a chain of steps. Each step looks up facts by an argument that is known by then. It binds the arguments that
are not known, and calls the next step for each fact. The last step emits the head. Steps share no state: they work on
the bindings and on the tables that they receive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Protocol, TypeAlias

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import (
    Atom,
    Builtin,
    Identity,
    Rule,
    variables,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.builtins import ARITHMETIC, COMPARISONS, compute
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Argument, Fact, Term, Var

Bindings: TypeAlias = list[Any]
Index: TypeAlias = dict[Any, list[Fact]]
Test: TypeAlias = Builtin | Identity

NO_FACTS: Final[Sequence[Fact]] = ()
EVERY: Final = None
"""The key under which an index by no argument has all facts of its predicate."""


class Tables(Protocol):
    """The input of steps: indexes and facts of the base and of the run, by the numbers that ``Indexes`` gives."""

    base_indexes: Sequence[Index]
    indexes: Sequence[Index]
    emissions: int
    """How often a head was emitted so far."""

    def holds(self, fact: Fact) -> bool: ...

    def emit(self, rule: int, bindings: Bindings) -> None: ...


Step: TypeAlias = Callable[[Bindings, Any], None]


@dataclass(slots=True)
class Indexes:
    """The indexes that some plans need, each by predicate and argument (0: by none); numbered as they come."""

    numbers: dict[tuple[str, int], int] = field(default_factory=dict)

    def number(self, predicate: str, position: int) -> int:
        return self.numbers.setdefault((predicate, position), len(self.numbers))

    def by_predicate(self) -> Mapping[str, tuple[tuple[int, int], ...]]:
        """Return the numbers and positions of the indexes of each predicate."""
        found: dict[str, list[tuple[int, int]]] = {}
        for (predicate, position), number in self.numbers.items():
            found.setdefault(predicate, []).append((number, position))
        return {predicate: tuple(entries) for predicate, entries in found.items()}


@dataclass(frozen=True, slots=True)
class Trigger:
    """The plan for a fact of one atom's predicate.

    ``constants`` are positions and the terms that must be there. ``binds`` are positions and the slots that they fill.
    ``repeats`` are positions that must equal a slot. ``guards`` are indexes and keys that must have a fact. While one
    has none, the rule cannot fire, and the fact that is missing will trigger it when it comes.
    """

    constants: tuple[tuple[int, Term], ...]
    binds: tuple[tuple[int, int], ...]
    repeats: tuple[tuple[int, int], ...]
    guards: tuple[tuple[int, Any], ...]
    slots: int
    first: Step


def slots_of(rule: Rule) -> dict[Var, int]:
    """Return a number for each variable of a rule."""
    slots: dict[Var, int] = {}
    for atom in (*rule.body, *rule.head):
        for variable in variables(atom):
            slots.setdefault(variable, len(slots))
    return slots


def triggers_of(number: int, rule: Rule, indexes: Indexes) -> list[tuple[str, Trigger]]:
    """Return a trigger for each class or property of a rule's body, with its predicate."""
    relations = [atom for atom in rule.body if isinstance(atom, Atom)]
    tests = [atom for atom in rule.body if not isinstance(atom, Atom)]
    found = []
    for place, atom in enumerate(relations):
        others = relations[:place] + relations[place + 1 :]
        found.append((atom.predicate, _Compiler(number, rule, indexes).trigger(atom, others, tests)))
    return found


def start_of(number: int, rule: Rule, indexes: Indexes) -> Step:
    """Return the step that begins a rule whose body has no class and no property."""
    return _Compiler(number, rule, indexes).chain([], [atom for atom in rule.body if not isinstance(atom, Atom)], set())


class _Compiler:
    """Compiles one rule for one of its atoms."""

    def __init__(self, number: int, rule: Rule, indexes: Indexes) -> None:
        self._number = number
        self._indexes = indexes
        self._slots = slots_of(rule)
        self._head = {variable for atom in rule.head for variable in variables(atom)}

    def trigger(self, atom: Atom, others: list[Atom], tests: list[Test]) -> Trigger:
        constants, binds, repeats, bound = [], [], [], set()
        for position, argument in enumerate(atom.arguments, start=1):
            if not isinstance(argument, Var):
                constants.append((position, argument))
            elif argument in bound:
                repeats.append((position, self._slots[argument]))
            else:
                binds.append((position, self._slots[argument]))
                bound.add(argument)
        guards = tuple(self._guard(other) for other in others if other.predicate != atom.predicate)
        first = self.chain(others, tests, bound)
        return Trigger(tuple(constants), tuple(binds), tuple(repeats), guards, len(self._slots), first)

    def _guard(self, atom: Atom) -> tuple[int, Any]:
        for position, argument in reversed(list(enumerate(atom.arguments, start=1))):
            if not isinstance(argument, Var):
                return self._indexes.number(atom.predicate, position), argument
        return self._indexes.number(atom.predicate, 0), EVERY

    def chain(self, relations: list[Atom], tests: list[Test], bound: set[Var]) -> Step:
        """Return the step that does all that is left, built from its end."""
        for test in tests:
            if self._is_ready(test, bound):
                left = [other for other in tests if other is not test]
                return self._test(test, relations, left, bound)
        if not relations:
            return self._emit()
        # The atom with the fewest unknown arguments comes first, since it has the fewest facts as a rule.
        best = min(relations, key=lambda atom: self._cost(atom, bound))
        left_atoms = [other for other in relations if other is not best]
        return self._match(best, left_atoms, tests, bound)

    def _cost(self, atom: Atom, bound: set[Var]) -> tuple[int, int]:
        unknown = {argument for argument in atom.arguments if isinstance(argument, Var) and argument not in bound}
        constants = sum(1 for argument in atom.arguments if not isinstance(argument, Var))
        known = len(atom.arguments) - len(unknown)
        return (len(unknown) if known else len(unknown) + 1, -constants)

    @staticmethod
    def _is_ready(test: Builtin | Identity, bound: set[Var]) -> bool:
        result = isinstance(test, Builtin) and test.name in ARITHMETIC
        needed = test.arguments[1:] if result else test.arguments
        return all(argument in bound for argument in needed if isinstance(argument, Var))

    def _emit(self) -> Step:
        number = self._number

        def step(bindings: Bindings, tables: Tables) -> None:
            tables.emit(number, bindings)

        return step

    def _value(self, argument: Argument) -> Callable[[Bindings], Term]:
        if isinstance(argument, Var):
            slot = self._slots[argument]
            return lambda bindings: bindings[slot]
        return lambda bindings: argument

    def _test(self, test: Builtin | Identity, relations: list[Atom], tests: list[Test], bound: set[Var]) -> Step:
        first, second = (self._value(argument) for argument in test.arguments[:2])
        if isinstance(test, Builtin) and test.name in ARITHMETIC:
            return self._arithmetic(test, relations, tests, bound)
        then = self.chain(relations, tests, bound)
        if isinstance(test, Identity):
            same = test.same

            def identity(bindings: Bindings, tables: Tables) -> None:
                if (first(bindings) == second(bindings)) is same:
                    then(bindings, tables)

            return identity
        holds = COMPARISONS[test.name]

        def comparison(bindings: Bindings, tables: Tables) -> None:
            if holds(first(bindings), second(bindings)):
                then(bindings, tables)

        return comparison

    def _arithmetic(self, test: Builtin, relations: list[Atom], tests: list[Test], bound: set[Var]) -> Step:
        target, name = test.arguments[0], test.name
        result, inputs = self._value(target), [self._value(argument) for argument in test.arguments[1:]]
        slot = self._slots[target] if isinstance(target, Var) and target not in bound else None
        then = self.chain(relations, tests, bound | {target} if isinstance(target, Var) else bound)

        def step(bindings: Bindings, tables: Tables) -> None:
            computed = compute(name, [value(bindings) for value in inputs])
            if computed is None:
                return
            if slot is not None:
                bindings[slot] = computed
            elif result(bindings) != computed:
                return
            then(bindings, tables)

        return step

    def _match(self, atom: Atom, relations: list[Atom], tests: list[Test], bound: set[Var]) -> Step:
        then = self.chain(relations, tests, bound | set(variables(atom)))
        known = [
            position
            for position, argument in enumerate(atom.arguments, start=1)
            if not isinstance(argument, Var) or argument in bound
        ]
        if len(known) == len(atom.arguments):
            return self._membership(atom, then)
        number = self._indexes.number(atom.predicate, known[0] if known else 0)
        key = self._value(atom.arguments[known[0] - 1]) if known else (lambda bindings: EVERY)
        free = [position for position in range(1, len(atom.arguments) + 1) if position not in known]
        slots = [self._slots[argument] for argument in atom.arguments if isinstance(argument, Var)]
        if len(free) == 2:
            return _both(number, slots[0], slots[1], then)
        target = atom.arguments[free[0] - 1]
        assert isinstance(target, Var)
        is_settled = self._head <= bound
        return (_any if is_settled else _one)(number, key, free[0], self._slots[target], then)

    def _membership(self, atom: Atom, then: Step) -> Step:
        predicate, values = atom.predicate, [self._value(argument) for argument in atom.arguments]
        if len(values) == 1:
            (only,) = values

            def has_class(bindings: Bindings, tables: Tables) -> None:
                if tables.holds((predicate, only(bindings))):
                    then(bindings, tables)

            return has_class
        first, second = values

        def has_value(bindings: Bindings, tables: Tables) -> None:
            if tables.holds((predicate, first(bindings), second(bindings))):
                then(bindings, tables)

        return has_value


def _one(number: int, key: Callable[[Bindings], Any], position: int, slot: int, then: Step) -> Step:
    """Return a step that binds one argument of each fact that has the other."""

    def step(bindings: Bindings, tables: Tables) -> None:
        wanted = key(bindings)
        for fact in tables.base_indexes[number].get(wanted, NO_FACTS):
            bindings[slot] = fact[position]
            then(bindings, tables)
        for fact in tables.indexes[number].get(wanted, NO_FACTS):
            bindings[slot] = fact[position]
            then(bindings, tables)

    return step


def _any(number: int, key: Callable[[Bindings], Any], position: int, slot: int, then: Step) -> Step:
    """Return a step like ``_one`` that ends with the first conclusion: the head is known, all others are the same."""

    def step(bindings: Bindings, tables: Tables) -> None:
        wanted = key(bindings)
        before = tables.emissions
        for index in (tables.base_indexes[number], tables.indexes[number]):
            for fact in index.get(wanted, NO_FACTS):
                bindings[slot] = fact[position]
                then(bindings, tables)
                if tables.emissions != before:
                    return

    return step


def _both(number: int, first: int, second: int, then: Step) -> Step:
    """Return a step that binds both arguments of each fact; of equal slots, where the arguments are equal."""

    def step(bindings: Bindings, tables: Tables) -> None:
        for index in (tables.base_indexes[number], tables.indexes[number]):
            for fact in index.get(EVERY, NO_FACTS):
                if first == second and fact[1] != fact[-1]:
                    continue
                bindings[first] = fact[1]
                bindings[second] = fact[-1]
                then(bindings, tables)

    return step
