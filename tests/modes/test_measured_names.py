"""Conditions have the measured qualities of the present run of a component, as long as they count."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.planners.modes.situation import measured_values
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.messages.management.system import ComponentState, SystemMeasurements, SystemStates
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.modes.mode_conditions import ConditionName, NameKind

NAMES = {
    "laser.clearness": ConditionName(NameKind.QUALITY, "laser", "clearness"),
    "laser.failed": ConditionName(NameKind.FAILED, "laser"),
}


@pytest.mark.parametrize(
    ("now", "run", "values", "found"),
    [
        (2.0, 1, {"clearness": 0.3}, {"laser.clearness": 0.3}),
        (4.1, 1, {"clearness": 0.3}, {}),
        (2.0, 2, {"clearness": 0.3}, {}),
        (2.0, 1, {"claerness": 0.3}, {}),
    ],
    ids=["measured", "late", "of another run", "not measured"],
)
def test_a_measured_quality_is_known_as_long_as_it_counts(
    now: float, run: int, values: dict[str, float], found: dict[str, float]
) -> None:
    states = SystemStates(0.0, (ComponentState("laser", run, State.ACTIVE),))
    measured = MeasuredQualities(1.0, "laser", 1, 1.0, values)
    assert measured_values(NAMES, states, SystemMeasurements(1.0, (measured,)), now) == found


def test_before_anything_was_measured_nothing_is_known() -> None:
    states = SystemStates(0.0, (ComponentState("laser", 1, State.ACTIVE),))
    assert measured_values(NAMES, states, None, 1.0) == {}
