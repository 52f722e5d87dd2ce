"""The analyse and plan steps on what is known now: facts, conclusions, and a design for each objective."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from regraft.adaptation_manager.planners.metacontrol.control.groundings import Grounded, Groundings
from regraft.adaptation_manager.planners.metacontrol.control.measurements import Times
from regraft.adaptation_manager.planners.metacontrol.control.modes.designs import Designs
from regraft.adaptation_manager.planners.metacontrol.control.monitor import Monitor
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Model, Objective, is_of
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.analysis import Analyser, Analysis
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Plan
from regraft.adaptation_manager.planners.metacontrol.reasoning.design_selection import plan
from regraft.adaptation_manager.planners.metacontrol.reasoning.resting import Resting
from regraft.adaptation_manager.planners.metacontrol.reasoning.situation import Situation, active_objectives


@dataclass(frozen=True, slots=True)
class Known:
    """All that a decision rests on but the knowledge base."""

    objectives: Sequence[Objective]
    groundings: Groundings
    monitor: Monitor
    resting: Resting
    designs: Designs
    unavailable: Mapping[str, str]
    returned: Collection[str]


@dataclass(frozen=True, slots=True)
class Decided:
    """The conclusions, the plan, and the measured qualities that counted, by objective.

    ``recovered`` are the components whose recovery was taken into account, ``returned`` the designs that can be entered
    again.
    """

    situation: Situation
    analysis: Analysis
    plan: Plan
    measured: dict[str, dict[str, float]]
    recovered: frozenset[str] = frozenset()
    returned: frozenset[str] = frozenset()

    def kept(self, groundings: Groundings, designs: Designs) -> tuple[Grounded, ...]:
        """Return the groundings of objectives that have no further design, and of what these require.

        One that is in the way of what was chosen is left out, with what it requires.
        """
        decisions = self.plan.decisions
        chosen = {each.objective: each.design for each in decisions if each.design is not None}
        without = [each.objective for each in decisions if each.design is None]

        def is_below(grounded: Grounded, names: Collection[str]) -> bool:
            return any(is_of(grounded.objective, name) for name in names)

        left = [each for each in groundings if each.objective not in chosen and is_below(each, without)]
        clashing = [
            each.objective for each in left if any(designs.clash(each.design, other) for other in chosen.values())
        ]
        return tuple(each for each in left if not is_below(each, clashing))


def situation_of(model: Model, known: Known, now: float, times: Times) -> tuple[Situation, dict[str, dict[str, float]]]:
    """Return the situation, and the measured qualities that count for each objective."""
    monitor = known.monitor
    facts = known.groundings.facts()
    bare = Situation(tuple(known.objectives), facts, monitor.statuses(), context=monitor.context)
    counting: dict[str, dict[str, float]] = {}
    lasting: dict[str, dict[str, float]] = {}
    errors: dict[str, Status] = {}
    for name, objective in active_objectives(model, bare).items():
        grounded = known.groundings.of(name)
        if grounded is None:
            continue
        counting[name] = monitor.measurements.counting(name, model.qualities, grounded.since, now, times)
        lasting[grounded.name] = monitor.measurements.lasting(
            objective, counting[name], model.qualities, grounded.since, now, times
        )
        if monitor.has_error(name, grounded.since):
            errors[grounded.name] = Status.IN_ERROR_FR
    situation = Situation(tuple(known.objectives), facts, bare.components, lasting, errors, monitor.context)
    return situation, counting


def concluded(
    analyser: Analyser, known: Known, now: float, times: Times
) -> tuple[Situation, Analysis, dict[str, dict[str, float]]]:
    """Return the situation of now, what follows from it, and the measured qualities that count."""
    situation, counting = situation_of(analyser.model, known, now, times)
    return situation, analyser.analyse(situation), counting


def planned(
    analyser: Analyser, known: Known, situation: Situation, analysis: Analysis, now: float, margin: float
) -> Plan:
    """Return a design for each objective, and for those that designs require."""
    return plan(
        analyser.model,
        situation,
        analysis,
        known.resting,
        now,
        clash=known.designs.clash,
        margin=margin,
        unavailable=known.unavailable,
        returned=known.returned,
    )
