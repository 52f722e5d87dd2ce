"""The observer of components reports a component that works but is unfit by what it measures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from regraft import ParameterError, State
from regraft.bus_schema.messages.management.system import SystemFaultKind
from regraft.bus_schema.model.lifecycle import Transition
from regraft.component.component import describe, parameter_set
from regraft.services.observers.component_observer import ComponentObserver
from tests.metacontrol.observers.scene import Scene, scene, written
from tests.metacontrol.observers.test_stacks import STACK, problems

LOW = {"component": "laser", "failed": "laser.charge < 0.5", "recovered": "laser.charge > 0.8"}
FAILED, RECOVERED = [("laser", "FALSE")], [("laser", "RECOVERED")]


@pytest.fixture
def seen(tmp_path: Path) -> Iterator[Scene]:
    """Return a system whose laser has a charge, 8 s after its start."""
    with scene(ComponentObserver, observed=written(tmp_path), period=1000.0, conditions=[LOW]) as made:
        made.measured = {"laser": {"charge": 0.9}}
        made.run(8.0)
        assert made.statuses() == [("camera", "TRUE"), ("laser", "TRUE")]
        yield made


def after(seen: Scene, charge: float) -> list[tuple[str, str]]:
    """Return what is reported within 3 s of a charge."""
    seen.measured = {"laser": {"charge": charge}}
    seen.run(3.0)
    return seen.statuses()


def test_a_component_fails_below_one_limit_and_recovers_above_the_other(seen: Scene) -> None:
    assert after(seen, 0.6) == []
    assert after(seen, 0.49) == FAILED
    assert after(seen, 0.6) == []
    assert after(seen, 0.79) == []
    assert after(seen, 0.81) == RECOVERED
    assert after(seen, 0.6) == []
    texts = [event.text for event in seen.rig.events if event.kind.startswith("observer.")]
    assert texts == ["laser has failed: laser.charge < 0.5", "laser has recovered"]


def test_what_is_not_known_changes_nothing(seen: Scene) -> None:
    seen.measured = {}
    seen.run(3.0)
    assert seen.statuses() == []
    assert after(seen, 0.4) == FAILED
    seen.measured = {}
    seen.run(3.0)
    assert seen.statuses() == []
    assert after(seen, 0.9) == RECOVERED


def test_a_measurement_that_is_late_changes_nothing(seen: Scene) -> None:
    seen.measured_at = seen.rig.clock.now() / 1e9 - 60.0
    assert after(seen, 0.4) == []


def test_a_fault_counts_besides_the_conditions(seen: Scene) -> None:
    assert after(seen, 0.4) == FAILED
    seen.faults["laser"] = SystemFaultKind.DIED
    assert after(seen, 0.9) == []
    seen.faults.clear()
    assert after(seen, 0.9) == RECOVERED


def test_a_component_stays_unfit_when_it_is_deactivated(seen: Scene) -> None:
    assert after(seen, 0.4) == FAILED
    seen.states["laser"] = State.INACTIVE
    seen.measured = {}
    seen.run(5.0)
    assert seen.statuses() == []


def test_each_of_several_conditions_is_a_failure(tmp_path: Path) -> None:
    hot = {"component": "laser", "failed": "laser.heat > 60", "recovered": "laser.heat < 50"}
    with scene(ComponentObserver, observed=written(tmp_path), period=1000.0, conditions=[LOW, hot]) as made:
        made.measured = {"laser": {"charge": 0.9, "heat": 70.0}}
        made.run(8.0)
        assert made.statuses()[-1:] == FAILED
        made.measured = {"laser": {"charge": 0.4, "heat": 40.0}}
        made.run(3.0)
        assert made.statuses() == []
        made.measured = {"laser": {"charge": 0.9, "heat": 40.0}}
        made.run(3.0)
        assert made.statuses() == RECOVERED


def test_a_failure_may_be_for_good(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), conditions=[LOW | {"recovered": "False"}]) as made:
        assert after(made, 0.4)[-1:] == FAILED
        after(made, 1.0)
        assert after(made, 1.0)[-1:] == FAILED


def test_a_further_run_and_a_further_activation_know_what_is_unfit(seen: Scene) -> None:
    assert after(seen, 0.4) == FAILED
    earlier = seen.rig.runtimes["observer"].component
    assert isinstance(earlier, ComponentObserver)
    seen.rig.transition("observer", Transition.DEACTIVATE)
    seen.rig.transition("observer", Transition.ACTIVATE)
    assert after(seen, 0.6) == [("camera", "TRUE"), *FAILED]
    known = earlier.snapshot()
    seen.rig.transition("observer", Transition.DEACTIVATE)
    given = {"observed": earlier.observed, "period": 1000.0, "conditions": [LOW]}
    later = seen.rig.add(ComponentObserver, "later", given, state=State.INACTIVE)
    later.restore(known)
    seen.rig.transition("later", Transition.ACTIVATE)
    assert after(seen, 0.6) == [("camera", "TRUE"), *FAILED]
    assert after(seen, 0.9) == RECOVERED


def test_measurements_are_read_only_where_there_are_conditions(tmp_path: Path) -> None:
    observed = {"observed": written(tmp_path)}
    assert "measurements" not in {port.name for port in describe(ComponentObserver, observed).ports}
    with_conditions = observed | {"conditions": [LOW]}
    assert "measurements" in {port.name for port in describe(ComponentObserver, with_conditions).ports}


@pytest.mark.parametrize(
    ("change", "field", "why"),
    [
        ({"failed": "laser.charge <"}, "conditions.0.failed", "'laser.charge <'"),
        ({"failed": "laser.charge"}, "conditions.0.failed", ""),
        ({"failed": "True"}, "conditions.0.failed", "speaks of nothing that is measured"),
        ({"recovered": "laser.charge + 1"}, "conditions.0.recovered", "true or false"),
        ({"component": ""}, "conditions.0.component", "is empty"),
    ],
)
def test_expressions_that_cannot_be_are_refused_by_field(change: dict[str, Any], field: str, why: str) -> None:
    try:
        parameter_set(ComponentObserver, {"conditions": [LOW | change]})
    except ParameterError as error:
        (problem,) = error.parts
        assert problem[0] == field
        assert why in problem[1]
    else:
        # The kind of a name's value is known with the architecture only.
        assert change == {"failed": "laser.charge"}


def stack_with(failed: str, component: str = "camera") -> str:
    """Return the stack with a condition."""
    condition = f"[{{component: {component}, failed: '{failed}', recovered: 'workshop.energy > 0.8'}}]"
    return STACK.replace("_components.yaml}", f"_components.yaml, conditions: {condition}}}")


@pytest.mark.parametrize(
    ("stack", "found"),
    [
        (stack_with("workshop.energy < 0.5"), ""),
        (stack_with("workshop.enrgy < 0.5"), "conditions.0.failed: workshop.enrgy: workshop has no 'enrgy'"),
        (stack_with("workshop.energy"), "conditions.0.failed: workshop.energy is a number, must be true or false"),
        (
            stack_with("workshop.energy < 0.5", "camra"),
            "conditions.0.component: there is no observed component 'camra'; did you mean 'camera'?",
        ),
    ],
)
def test_conditions_are_compared_with_the_stack(stack: str, found: str, tmp_path: Path) -> None:
    all_found = problems(tmp_path, stack)
    assert len(all_found) == bool(found)
    assert all(found in each for each in all_found)
