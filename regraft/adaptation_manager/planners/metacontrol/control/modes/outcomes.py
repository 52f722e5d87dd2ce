"""The causes of an adaptation that failed: the designs to blame, and their components."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from regraft.adaptation_manager.planners.manager_client import CarriedOut, is_stale
from regraft.adaptation_manager.planners.metacontrol.control.modes.designs import Designs
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Decision
from regraft.bus_schema.model.adaptation import Outcome, StepState


def is_fault_of_designs(done: CarriedOut) -> bool:
    """Return whether the designs are to blame: the manager has judged or tried their changes.

    It has not where others have changed the architecture meanwhile, or have cancelled the adaptation.
    """
    return done.report is not None and not is_stale(done.report) and done.report.outcome is not Outcome.CANCELLED


def components_to_blame(done: CarriedOut) -> frozenset[str]:
    """Return the components that were at fault, empty if they are not known.

    A step that failed and was undone since keeps its error.
    """
    if done.report is None:
        return frozenset()
    found = {each.component for each in done.report.violations if each.component}
    found |= {each.component for each in done.report.steps if each.state is StepState.FAILED or each.error}
    return frozenset(found - {""})


def to_blame(decisions: Sequence[Decision], designs: Designs, components: Iterable[str]) -> tuple[Decision, ...]:
    """Return the decisions whose designs change components that were at fault; all of them if none does."""
    at_fault = set(components)
    found = tuple(
        each
        for each in decisions
        if each.design is not None and at_fault & {change.component for change in designs.of(each.design).changes}
    )
    return found or tuple(decisions)
