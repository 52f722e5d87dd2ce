"""All solvers find what looking at every combination finds; what they cannot prove, they say."""

from __future__ import annotations

import math
import sys
from random import Random

import numpy as np
import pytest

from benchmarks.instances import chain
from regraft.adaptation_manager.planners.choices.problem import UNKNOWN, Problem, Term
from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Limit, Rule, Table, relation
from regraft.adaptation_manager.planners.choices.solvers.branch_and_bound import BranchAndBound
from regraft.adaptation_manager.planners.choices.solvers.cp_sat import CpSat
from regraft.adaptation_manager.planners.choices.solvers.exhaustive import Exhaustive
from regraft.adaptation_manager.planners.choices.solvers.named import SOLVERS, solver_named
from regraft.adaptation_manager.planners.choices.solvers.protocol import CannotSolve, Effort, Solution, Solver
from regraft.bus_schema.errors import BadMessage

SHARES = (0.3, 0.4, 0.6, 0.8)
QUICK, ALL = 60, 1000


def needs_cp_sat() -> None:
    pytest.importorskip("ortools", reason="the extra cp-sat is not installed")


def agree(solver: Solver, problem: Problem, most: int = 3) -> None:
    """Check one solver's answer against the oracle's."""
    expected, found = Exhaustive().solve(problem, most), solver.solve(problem, most)
    assert [each.worth for each in found.found] == pytest.approx([each.worth for each in expected.found], abs=1e-8)
    assert len({each.chosen for each in found.found}) == len(found.found)
    for each in found.found:
        assert problem.keeps(each.chosen)
        assert problem.worth(each.chosen) == each.worth
    assert found.proven
    assert found.gap == 0.0


def tangled(rng: Random, most: int) -> Problem:
    """Return any instance of at most so many combinations: rules and terms over one to three slots, unknown worths."""
    sizes = [rng.randint(1, 6)]
    while len(sizes) < 8 and rng.random() < 0.9 and int(np.prod(sizes)) * 6 <= most:
        sizes.append(rng.randint(1, 6))
    rules: list[Rule] = []
    for number in range(rng.randint(0, 6)):
        scope = tuple(rng.sample(range(len(sizes)), min(len(sizes), rng.randint(1, 3))))
        kept = np.array(_table(rng, [sizes[slot] for slot in scope])) > rng.choice((0.1, 0.4))
        form = rng.randint(0, 2)
        if form == 0:
            ways = tuple((slot, rng.getrandbits(sizes[slot])) for slot in scope)
            rules.append(Clause(number, ways))
        elif len(scope) == 2:
            rules.append(relation(number, scope[0], scope[1], kept))
        else:
            rules.append(Table(number, scope, kept))
    for number in range(rng.randint(0, 2)):
        uses = tuple((slot, tuple(rng.randint(-1, 4) * 0.1 for _ in range(size))) for slot, size in enumerate(sizes))
        rules.append(Limit(9, f"amount {number}", rng.choice((0.1, 0.25, 0.4)) * len(sizes), uses))
    terms = []
    for _ in range(rng.randint(0, 5)):
        scope = tuple(rng.sample(range(len(sizes)), min(len(sizes), rng.randint(0, 3))))
        worth = np.array(_table(rng, [sizes[slot] for slot in scope])) * 2.0 - 1.0
        terms.append(Term(scope, np.where(worth < rng.choice((-2.0, -0.9)), UNKNOWN, worth)))
    return Problem(tuple(sizes), tuple(rules), tuple(terms))


def _table(rng: Random, shape: list[int]) -> object:
    return [_table(rng, shape[1:]) for _ in range(shape[0])] if shape else rng.random()


def any_problem(seed: int, most: int) -> Problem:
    """Return instances of both kinds in turns."""
    rng = Random(f"instance {seed}")
    if seed % 2:
        return tangled(rng, most)
    slots = rng.randint(2, 5)
    alternatives = rng.randint(2, min(10, math.floor(most ** (1 / slots) + 1e-9)))
    return chain(rng, slots, alternatives, rng.choice(SHARES))


@pytest.mark.parametrize("seed", range(QUICK))
def test_branch_and_bound_finds_what_looking_at_every_combination_finds(seed: int) -> None:
    agree(BranchAndBound(), any_problem(seed, 5_000))


@pytest.mark.evidence
def test_branch_and_bound_equals_the_oracle_on_a_thousand_instances_of_up_to_100_000_combinations() -> None:
    for seed in range(ALL):
        agree(BranchAndBound(), any_problem(seed, 100_000))


@pytest.mark.parametrize("seed", range(12))
def test_cp_sat_finds_what_looking_at_every_combination_finds(seed: int) -> None:
    needs_cp_sat()
    agree(CpSat(), any_problem(seed, 1_000))


@pytest.mark.evidence
def test_cp_sat_equals_branch_and_bound_on_large_instances() -> None:
    needs_cp_sat()
    for seed in range(20):
        problem = chain(Random(f"large {seed}"), 8, 10, SHARES[seed % len(SHARES)])
        one, other = CpSat().solve(problem), BranchAndBound().solve(problem)
        assert [each.worth for each in one.found] == pytest.approx([each.worth for each in other.found], abs=1e-8)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_choice_that_rules_leave_nothing_of_is_proven_empty(name: str) -> None:
    if name == "cp_sat":
        needs_cp_sat()
    apart = relation(0, 0, 1, np.zeros((2, 2), dtype=bool))
    found = solver_named(name).solve(Problem((2, 2), (apart,)))
    assert (found.found, found.proven, found.bound) == ((), True, -math.inf)


@pytest.mark.parametrize("name", SOLVERS)
def test_without_an_objective_anything_that_keeps_the_rules_is_found(name: str) -> None:
    if name == "cp_sat":
        needs_cp_sat()
    problem = Problem((3, 3), (Clause(0, ((0, 0b100),)), Limit(1, "power", 1.0, ((1, (2.0, 1.0, 3.0)),))))
    assert solver_named(name).solve(problem).found[0].chosen == (2, 1)


@pytest.mark.parametrize("name", SOLVERS)
def test_where_a_part_of_the_objective_that_counts_always_is_unknown_nothing_is_found(name: str) -> None:
    if name == "cp_sat":
        needs_cp_sat()
    terms = (Term((0,), np.array([1.0, 2.0])), Term((), np.array(UNKNOWN)))
    found = solver_named(name).solve(Problem((2, 2), (), terms))
    assert (found.found, found.proven, found.bound) == ((), True, UNKNOWN)


@pytest.mark.parametrize("name", SOLVERS)
def test_what_is_worth_nothing_everywhere_is_found_with_that_worth(name: str) -> None:
    if name == "cp_sat":
        needs_cp_sat()
    for worth in (np.zeros(2), np.array([UNKNOWN, 0.0])):
        found = solver_named(name).solve(Problem((2, 2), (), (Term((0,), worth),)))
        assert (found.found[0].worth, found.proven, found.bound) == (0.0, True, 0.0)


def test_a_search_that_is_given_up_says_how_much_better_the_best_may_be() -> None:
    problem = chain(Random("cut short"), 9, 10, 0.35)
    whole = BranchAndBound().solve(problem)
    assert whole.proven
    cut = [BranchAndBound().solve(problem, effort=Effort(steps=steps)) for steps in (1, 12, 40)]
    for solution in cut:
        assert not solution.proven
        assert solution.bound >= whole.found[0].worth - 1e-9
        if solution.found:
            assert solution.gap == pytest.approx(solution.bound - solution.found[0].worth)
            assert solution.found[0].worth <= whole.found[0].worth
    assert cut[0].gap == math.inf


def test_equal_steps_give_equal_answers() -> None:
    def answer() -> tuple[object, ...]:
        found: Solution = BranchAndBound().solve(chain(Random("again"), 9, 10, 0.35), 2, Effort(steps=60))
        return found.found, found.bound, found.steps

    assert answer() == answer()


def test_cp_sat_keeps_its_deadline_and_states_a_bound() -> None:
    needs_cp_sat()
    problem = chain(Random("late"), 15, 20, 0.35)
    solution = CpSat().solve(problem, effort=Effort(deadline=0.05))
    assert solution.proven or solution.gap > 0.0
    for each in solution.found:
        assert each.worth <= solution.bound + 1e-9


def test_equal_steps_of_cp_sat_give_equal_answers() -> None:
    needs_cp_sat()
    problem = chain(Random("repeatable"), 12, 15, 0.4)
    first, second = (CpSat().solve(problem, effort=Effort(steps=50_000)) for _ in range(2))
    assert (first.found, first.bound) == (second.found, second.bound)


def test_exhaustive_refuses_what_it_would_never_end_with() -> None:
    with pytest.raises(CannotSolve, match=r"10000000000 combinations.*: take branch_and_bound or cp_sat"):
        Exhaustive().solve(Problem((10,) * 10))


def test_without_its_extra_cp_sat_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ortools.sat.python", None)
    with pytest.raises(CannotSolve, match=r"pip install 'regraft\[cp-sat\]'; or take branch_and_bound"):
        CpSat().solve(Problem((1,)))


def test_a_solver_that_does_not_exist_is_refused_with_the_nearest() -> None:
    with pytest.raises(BadMessage, match="there is no solver 'cpsat'; did you mean 'cp_sat'"):
        solver_named("cpsat")


def test_a_wide_clause_over_many_slots_is_kept() -> None:
    ways = tuple((slot, 0b1) for slot in range(8))
    terms = tuple(Term((slot,), np.arange(6.0)) for slot in range(8))
    problem = Problem((6,) * 8, (Clause(0, ways),), terms)
    (best,) = BranchAndBound().solve(problem).found
    assert best.worth == 35.0
    assert best.chosen.count(0) == 1
