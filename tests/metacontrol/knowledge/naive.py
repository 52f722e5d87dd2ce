"""A forward chainer by enumeration, as slow as it is simple: what the real one is compared with."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator

from hypothesis import strategies as st

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import Atom, Builtin, Identity, Rule
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import (
    Argument,
    Data,
    Fact,
    Term,
    Var,
    number,
    text,
    truth,
)

INDIVIDUALS = ("i#a", "i#b", "i#c")
VALUES: tuple[Term, ...] = (number(0.5), number(1), number(2), text("1"), text("z"), truth(True))
CLASSES = ("c#A", "c#B")
PROPERTIES = ("p#p", "p#q")
DATA_PROPERTIES = ("d#v", "d#w")
VARIABLES = tuple(Var(f"x#{name}") for name in "uvwx")
COMPARISONS = ("equal", "notEqual", "lessThan", "lessThanOrEqual", "greaterThan", "greaterThanOrEqual")


def naive(rules: Collection[Rule], facts: Collection[Fact]) -> frozenset[Fact]:
    """Return all that follows, by trying each value for each variable until nothing is new."""
    known = set(facts)
    while True:
        found = {fact for rule in rules for fact in _consequences(rule, known)}
        if found <= known:
            return frozenset(known)
        known |= found


def _consequences(rule: Rule, known: set[Fact]) -> Iterator[Fact]:
    names = sorted(
        {each for atom in (*rule.body, *rule.head) for each in atom.arguments if isinstance(each, Var)}, key=str
    )
    domain = sorted({term for fact in known for term in fact[1:]}, key=str)
    for values in itertools.product(domain, repeat=len(names)):
        bound = dict(zip(names, values, strict=True))
        if all(_holds(atom, bound, known) for atom in rule.body):
            for atom in rule.head:
                yield _fact(atom, bound)


def _terms(arguments: tuple[Argument, ...], bound: dict[Var, Term]) -> list[Term]:
    return [bound[each] if isinstance(each, Var) else each for each in arguments]


def _fact(atom: Atom, bound: dict[Var, Term]) -> Fact:
    terms = _terms(atom.arguments, bound)
    return (atom.predicate, terms[0]) if len(terms) == 1 else (atom.predicate, terms[0], terms[1])


def _holds(atom: Atom | Builtin | Identity, bound: dict[Var, Term], known: set[Fact]) -> bool:
    if isinstance(atom, Atom):
        return _fact(atom, bound) in known
    left, right = _terms(atom.arguments, bound)
    if isinstance(atom, Identity):
        return (left == right) is atom.same
    if not (isinstance(left, Data) and isinstance(right, Data)):
        return False
    if atom.name in {"equal", "notEqual"}:
        return (left == right) is (atom.name == "equal")
    if left.kind != right.kind or left.kind == "truth":
        return False
    less, equal = left.value < right.value, left.value == right.value  # type: ignore[operator]
    return {
        "lessThan": less,
        "lessThanOrEqual": less or equal,
        "greaterThan": not (less or equal),
        "greaterThanOrEqual": not less,
    }[atom.name]


def _arguments(constants: tuple[Term, ...]) -> st.SearchStrategy[Argument]:
    return st.one_of(st.sampled_from(VARIABLES), st.sampled_from(VARIABLES), st.sampled_from(constants))


ATOMS = st.one_of(
    st.builds(lambda name, one: Atom(name, (one,)), st.sampled_from(CLASSES), _arguments(INDIVIDUALS)),
    st.builds(
        lambda name, one, two: Atom(name, (one, two)),
        st.sampled_from(PROPERTIES),
        _arguments(INDIVIDUALS),
        _arguments(INDIVIDUALS),
    ),
    st.builds(
        lambda name, one, two: Atom(name, (one, two)),
        st.sampled_from(DATA_PROPERTIES),
        _arguments(INDIVIDUALS),
        _arguments(VALUES),
    ),
)


@st.composite
def rules(draw: st.DrawFn) -> Rule:
    """Draw a safe rule: its head and its comparisons use what its body binds."""
    relations = draw(st.lists(ATOMS, min_size=1, max_size=3))
    bound = [each for atom in relations for each in atom.arguments if isinstance(each, Var)]
    pool: list[Argument] = [*bound, *bound, *VALUES] if bound else list(VALUES)
    things: list[Argument] = [*bound, *bound, *INDIVIDUALS]
    tests: list[Builtin | Identity] = []
    for _ in range(draw(st.integers(0, 2))):
        if draw(st.booleans()):
            pair = (draw(st.sampled_from(pool)), draw(st.sampled_from(pool)))
            tests.append(Builtin(draw(st.sampled_from(COMPARISONS)), pair))
        else:
            pair = (draw(st.sampled_from(things)), draw(st.sampled_from(things)))
            tests.append(Identity(draw(st.booleans()), pair))
    heads = []
    for _ in range(draw(st.integers(1, 2))):
        atom = draw(ATOMS)
        arguments = tuple(
            each if not isinstance(each, Var) or each in bound else draw(st.sampled_from(things))
            for each in atom.arguments
        )
        heads.append(Atom(atom.predicate, arguments))
    body = draw(st.permutations([*relations, *tests]))
    return Rule("drawn", tuple(body), tuple(heads))


FACTS = st.one_of(
    st.tuples(st.sampled_from(CLASSES), st.sampled_from(INDIVIDUALS)),
    st.tuples(st.sampled_from(PROPERTIES), st.sampled_from(INDIVIDUALS), st.sampled_from(INDIVIDUALS)),
    st.tuples(st.sampled_from(DATA_PROPERTIES), st.sampled_from(INDIVIDUALS), st.sampled_from(VALUES)),
)
RULES = st.lists(rules(), min_size=1, max_size=5)
BASES = st.lists(FACTS, max_size=14)
