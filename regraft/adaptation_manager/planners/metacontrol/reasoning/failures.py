"""Puts designs to rest that were observed to fail, with what is to blame."""

from __future__ import annotations

from regraft.adaptation_manager.planners.metacontrol.knowledge import vocabulary
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.explanation import Reason
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analysis
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Rest, Resting


def rest_failed(analysis: Analysis, resting: Resting, now: float) -> tuple[Rest, ...]:
    """Let each design rest that fails now, for the objective that it fails, and return the rests.

    The qualities that were measured to break a requirement are to blame.
    """
    return tuple(
        resting.add(design, objective, now, *_blame(analysis.why_failed(design, objective)))
        for design, objective in analysis.failed
    )


def _blame(reason: Reason | None) -> tuple[frozenset[str], str]:
    if reason is None:
        return frozenset(), "it failed"
    qualities = frozenset(
        str(each.fact[2])
        for each in reason.premises
        if each.fact[0] == vocabulary.IS_QUALITY_TYPE and len(each.fact) == 3
    )
    if not qualities:
        return qualities, f"it failed, by rule {reason.rule}"
    listed = ", ".join(sorted(map(local_name, qualities)))
    return qualities, f"{listed} was measured to break the requirement: {', '.join(reason.checks)}"
