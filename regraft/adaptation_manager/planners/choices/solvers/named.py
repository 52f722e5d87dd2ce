"""The solvers by their names."""

from __future__ import annotations

from typing import Final

from regraft.adaptation_manager.planners.choices.solvers.branch_and_bound import BranchAndBound
from regraft.adaptation_manager.planners.choices.solvers.cp_sat import CpSat
from regraft.adaptation_manager.planners.choices.solvers.exhaustive import Exhaustive
from regraft.adaptation_manager.planners.choices.solvers.protocol import Solver
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.suggestions import no_such

SOLVERS: Final[dict[str, Solver]] = {each.name: each for each in (BranchAndBound(), CpSat(), Exhaustive())}


def solver_named(name: str) -> Solver:
    """Return the solver of a name; raises BadMessage."""
    if name not in SOLVERS:
        raise BadMessage(no_such("solver", name, SOLVERS))
    return SOLVERS[name]
