"""Choosing among ten million combinations: seven slots of ten alternatives, with incompatible neighbours and faults."""

from __future__ import annotations

from random import Random

from benchmarks.harness import Effort, Result, percentile
from benchmarks.instances import chain
from regraft.adaptation_manager.planners.choices.solvers.branch_and_bound import BranchAndBound
from regraft.adaptation_manager.planners.choices.solvers.exhaustive import Exhaustive
from regraft.adaptation_manager.planners.choices.solvers.protocol import Effort as Steps

SLOTS, ALTERNATIVES = 7, 10
INSTANCES = 30
LIMIT = 50.0
"""ms of processor time that 95 % of the instances may take."""
SHARES = {"loose": 0.6, "tight": 0.35}
"""How much of each amount's greatest use there is; with less than 0.3 hardly any instance has a solution."""
ORACLE_INSTANCES = 2
MAX_STEPS = 100_000


def choices(effort: Effort) -> list[Result]:
    """Choose in random instances under loose and under tight limits; for information, also by looking at all."""
    budgets = [_chosen(name, share, effort) for name, share in SHARES.items()]
    return [*budgets, _large(effort)]


def _large(effort: Effort) -> Result:
    """Choose among 3·10^19 combinations, which is for information."""
    problems = [chain(Random(f"large {seed}"), 15, 20, 0.4) for seed in range(effort.count(4))]
    taken = [BranchAndBound().solve(problem, effort=Steps(MAX_STEPS)) for problem in problems]
    seconds = [found.seconds * 1e3 for found in taken]
    note = f"processor time; {sum(found.proven for found in taken)} of {len(taken)} proven"
    return Result("choosing in 3·10^19, median", percentile(seconds, 0.5), "ms", note=note)


def _chosen(name: str, share: float, effort: Effort) -> Result:
    count = effort.count(INSTANCES, least=2)
    problems = [chain(Random(f"{name} {seed}"), SLOTS, ALTERNATIVES, share) for seed in range(count)]
    solver = BranchAndBound()
    rounds = [[solver.solve(problem) for problem in problems] for _ in range(effort.rounds)]
    taken = [percentile([found.seconds * 1e3 for found in each], 0.95) for each in rounds]
    nodes = percentile([found.steps for found in rounds[0]], 0.5)
    solved = sum(1 for found in rounds[0] if found.found)
    oracle = [Exhaustive().solve(problem).seconds * 1e3 for problem in problems[: effort.count(ORACLE_INSTANCES)]]
    return Result(
        f"choosing in 10^7, {name} limits, p95",
        percentile(taken, 0.5),
        "ms",
        baseline=percentile(oracle, 0.5),
        against="looking at every combination",
        spread=(min(taken), max(taken)),
        limit=LIMIT,
        note=f"processor time; {effort.rounds} rounds of {count}, {solved} solvable, median {nodes:.0f} nodes",
    )
