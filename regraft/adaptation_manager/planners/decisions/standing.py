"""The qualities of what stands, by what is measured of it; where that is not known, the estimate counts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from regraft.adaptation_manager.planners.choices.choosing import standing_selections
from regraft.adaptation_manager.planners.choices.estimates import NoEstimates
from regraft.adaptation_manager.planners.choices.objective import Evaluation, MeasuredValue, Objective
from regraft.adaptation_manager.planners.decisions.measurements import MeasuredSituation, Measurement, Measurements
from regraft.adaptation_manager.planners.decisions.model import Decision, DecisionQuality
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.expressions import Expression, Unknown
from regraft.bus_schema.model.robots.scoped_changes import Names


@dataclass(frozen=True, slots=True)
class Standing:
    """The measured qualities of the present choice, with their sources; ``notes`` name those that are not, and why."""

    values: dict[str, MeasuredValue]
    sources: dict[str, dict[str, Measurement]]
    notes: tuple[str, ...] = ()

    def plain(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            name: {
                "value": measured.value,
                "from": {each: {"value": m.value, "stamp": m.stamp} for each, m in self.sources[name].items()},
            }
            for name, measured in self.values.items()
        }

    def without_values(self, why: str) -> Standing:
        """Return that nothing of it counts, and why."""
        notes = (f"{name} is estimated, though it is measured: {why}" for name in self.values)
        return Standing({}, {}, (*self.notes, *notes))


NOTHING_MEASURED = Standing({}, {})


def standing_of(
    decision: Decision, context: Mapping[str, Any], measurements: Measurements, architecture: Architecture, scope: str
) -> Standing:
    """Return the qualities that are measured by components, of the alternatives that stand in an architecture."""
    selections = standing_selections(decision.slots, architecture)
    chosen = {index: selection for index, selection in enumerate(selections) if selection is not None}
    objective = Objective(decision.utility, named=decision.measured())
    evaluation = Evaluation(decision.slots, objective, MeasuredSituation(context, measurements), NoEstimates())
    found = Standing({}, {})
    notes = []
    for quality, names in _measured_by_components(decision):
        sources = {name: measurements.found[name] for name in names if name in measurements.found}
        same = quality.measured is quality.estimated
        if same and not all(each.declared for each in sources.values()):
            continue  # one expression for both, of what the class only estimates
        try:
            value = evaluation.partly(Expression(quality.name), chosen)
        except Unknown as error:
            notes.append(f"{quality.name} is {'estimated' if quality.estimated else 'unknown'}: {error}")
            continue
        slots = frozenset(_slots_of(decision, names, Names(scope)))
        found.values[quality.name] = MeasuredValue(value, selections, slots, quality.estimated)
        found.sources[quality.name] = sources
    return replace(found, notes=tuple(notes))


def _measured_by_components(decision: Decision) -> Iterator[tuple[DecisionQuality, tuple[str, ...]]]:
    for quality in decision.qualities:
        names = decision.measured_names(quality)
        if names:
            yield quality, names


def _slots_of(decision: Decision, names: tuple[str, ...], scope: Names) -> Iterator[int]:
    """Yield the slots that set something of the components that measure."""
    components = {scope.component(name.rpartition(".")[0]) for name in names}
    for index, slot in enumerate(decision.slots):
        if any(setting.component in components for each in slot.alternatives for setting in each.every_setting):
            yield index
