"""The forward chainer concludes what enumeration concludes, whatever the order, and never without a reason."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import Atom, Builtin, Rule
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.chainer import (
    Conclusions,
    Program,
    TooManyFacts,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.conflicts import conflicts
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.explanation import explain
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Fact, Var, number
from tests.metacontrol.knowledge.naive import BASES, RULES, naive

X, Y, Z, V, W = (Var(f"x#{name}") for name in "xyzvw")
EDGE = Rule("edge", (Atom("t#edge", (X, Y)),), (Atom("t#path", (X, Y)),))
PATH = Rule("path", (Atom("t#path", (X, Y)), Atom("t#edge", (Y, Z))), (Atom("t#path", (X, Z)),))


@settings(max_examples=400, deadline=None)
@given(RULES, BASES)
def test_the_conclusions_are_those_of_enumeration(rules: list[Rule], facts: list[Fact]) -> None:
    assert Program(rules).conclude(facts).all() == naive(rules, facts)


@settings(max_examples=200, deadline=None)
@given(RULES, BASES, st.randoms(use_true_random=False))
def test_the_order_of_rules_and_facts_has_no_influence(rules: list[Rule], facts: list[Fact], chance: object) -> None:
    one = Program(rules).conclude(facts)
    chance.shuffle(rules)  # type: ignore[attr-defined]
    chance.shuffle(facts)  # type: ignore[attr-defined]
    other = Program(rules).conclude(facts)
    assert one.derived() == other.derived()
    for fact in one.derived():
        assert one.derivation(fact) == other.derivation(fact)


@settings(max_examples=200, deadline=None)
@given(RULES, BASES, BASES)
def test_facts_that_do_not_change_may_be_concluded_from_once(
    rules: list[Rule], still: list[Fact], changing: list[Fact]
) -> None:
    program = Program(rules)
    base = program.over(still)
    assert base.conclude(changing).all() == program.conclude([*still, *changing]).all()
    assert base.conclude().all() == program.conclude(still).all()
    assert base.conclude(changing).all() == naive(rules, [*still, *changing])


def assert_well_founded(conclusions: Conclusions, given: set[Fact]) -> None:
    """Assert that each derivation rests on facts that were there before it."""
    before = set(given)
    for fact in conclusions.derived():
        derivation = conclusions.derivation(fact)
        assert derivation is not None
        assert set(derivation.premises()) <= before, fact
        before.add(fact)
    assert before == conclusions.all()


@settings(max_examples=200, deadline=None)
@given(RULES, BASES, BASES)
def test_each_conclusion_rests_on_given_facts_and_not_on_itself(
    rules: list[Rule], still: list[Fact], changing: list[Fact]
) -> None:
    conclusions = Program(rules).over(still).conclude(changing)
    assert_well_founded(conclusions, {fact for fact in conclusions.all() if conclusions.derivation(fact) is None})
    for fact in conclusions.all():
        assert explain(conclusions, fact) is not None


def test_a_circular_rule_ends() -> None:
    circle: list[Fact] = [("t#edge", f"n{i}", f"n{(i + 1) % 50}") for i in range(50)]
    conclusions = Program([EDGE, PATH]).conclude(circle)
    assert len(conclusions.of("t#path")) == 2500
    assert_well_founded(conclusions, set(circle))


def test_arithmetic_that_feeds_itself_ends_with_an_error_that_names_the_rule() -> None:
    counting = Rule(
        "counting",
        (Atom("t#at", (X, V)), Builtin("add", (W, V, number(1)))),
        (Atom("t#at", (X, W)),),
        file="domain.owl",
    )
    with pytest.raises(TooManyFacts, match=r"domain.owl: rule 'counting': more than 1000 facts"):
        Program([counting], max_facts=1000).conclude([("t#at", "n", number(0))])


def test_arithmetic_binds_its_result_and_tests_one_that_is_known() -> None:
    total = Rule(
        "total", (Atom("t#a", (X, V)), Atom("t#b", (X, W)), Builtin("add", (Z, V, W))), (Atom("t#sum", (X, Z)),)
    )
    twice = Rule("twice", (Atom("t#a", (X, V)), Builtin("multiply", (number(4), V, number(2)))), (Atom("t#two", (X,)),))
    less = Rule("less", (Atom("t#a", (X, V)), Builtin("subtract", (W, V, number(5)))), (Atom("t#less", (X, W)),))
    facts: list[Fact] = [("t#a", "n", number(2)), ("t#b", "n", number(0.5)), ("t#a", "m", "individual")]
    conclusions = Program([total, twice, less]).conclude(facts)
    assert set(conclusions.derived()) == {("t#less", "n", number(-3)), ("t#two", "n"), ("t#sum", "n", number(2.5))}


def test_a_result_that_is_no_finite_number_is_no_result() -> None:
    grow = Rule("grow", (Atom("t#a", (X, V)), Builtin("multiply", (W, V, V))), (Atom("t#a", (X, W)),))
    conclusions = Program([grow]).conclude([("t#a", "n", number(1e200))])
    assert conclusions.derived() == ()


def test_an_explanation_shows_rules_facts_and_comparisons() -> None:
    low = Rule(
        "low",
        (Atom("t#measured", (X, V)), Atom("t#required", (X, W)), Builtin("lessThan", (V, W))),
        (Atom("t#broken", (X,)),),
        file="quality.owl",
    )
    alarm = Rule("alarm", (Atom("t#broken", (X,)),), (Atom("t#alarm", (X,)),))
    facts: list[Fact] = [("t#measured", "n", number(0.4)), ("t#required", "n", number(0.5))]
    conclusions = Program([low, alarm]).conclude(facts)
    reason = explain(conclusions, ("t#alarm", "n"))
    assert reason is not None
    assert reason.text().splitlines() == [
        "alarm(n): by alarm",
        "  broken(n): by low (quality.owl)",
        "    0.4 < 0.5",
        "    measured(n, 0.4): given",
        "    required(n, 0.5): given",
    ]
    assert reason.as_data()["rule"] == "alarm"
    assert explain(conclusions, ("t#alarm", "m")) is None


def test_an_explanation_shows_a_fact_that_is_used_often_once() -> None:
    """Each number's fact has the one below as its premise twice: the full tree would have 2 ** 40 leaves."""
    rules = [
        Rule(f"r{i}", (Atom(f"t#{i}", (X,)), Atom(f"t#{i}", (Y,))), (Atom(f"t#{i + 1}", (X,)),)) for i in range(40)
    ]
    reason = explain(Program(rules).conclude([("t#0", "n")]), ("t#40", "n"))
    assert reason is not None
    assert len(reason.text().splitlines()) == 81


def test_two_conclusions_for_a_property_with_one_value_are_a_conflict_that_names_both_rules() -> None:
    one = Rule("one", (Atom("t#A", (X,)),), (Atom("t#status", (X, number(1))),))
    two = Rule("two", (Atom("t#A", (X,)),), (Atom("t#status", (X, number(2))),))
    conclusions = Program([one, two]).conclude([("t#A", "n"), ("t#A", "m"), ("t#B", "m")])
    found = conflicts(conclusions, ["t#status"], [["t#A", "t#B"]])
    assert [each.text(conclusions) for each in found] == [
        "m: status has one value at most: status(m, 1) by one; status(m, 2) by two",
        "n: status has one value at most: status(n, 1) by one; status(n, 2) by two",
        "m: the classes are disjoint: A(m) given; B(m) given",
    ]
