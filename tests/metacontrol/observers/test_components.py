"""The observer of components reports failures and recoveries, once each and then again now and then."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft import State
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.system import SystemFaultKind
from regraft.bus_schema.model.lifecycle import Transition
from regraft.services.observers.component_observer import ComponentObserver
from tests.metacontrol.observers.scene import Scene, scene, written

KINDS = [SystemFaultKind.FAILED, SystemFaultKind.DIED, SystemFaultKind.HUNG, SystemFaultKind.QUARANTINED]
PICTURES = {"sensors": [{"topic": "picture", "component": "camera"}]}


@pytest.fixture
def seen(tmp_path: Path) -> Iterator[Scene]:
    """Return a system that is observed, 8 s after its start."""
    with scene(ComponentObserver, observed=written(tmp_path), period=1000.0, **PICTURES) as made:
        made.run(8.0)
        assert made.statuses() == [("camera", "TRUE"), ("laser", "TRUE")]
        yield made


@pytest.mark.parametrize("kind", KINDS)
def test_a_fault_is_a_failure_until_it_is_over(seen: Scene, kind: SystemFaultKind) -> None:
    seen.faults["camera"] = kind
    seen.run(3.0)
    assert seen.news() == [("error", "Component status", {"camera": "FALSE"})]
    seen.faults.clear()
    seen.run(3.0)
    assert seen.news() == [("ok", "Component status", {"camera": "RECOVERED"})]
    assert [(event.kind, event.subject) for event in seen.rig.events if event.kind.startswith("observer.")] == [
        ("observer.failed", "observer"),
        ("observer.recovered", "observer"),
    ]


def test_an_exception_in_a_handler_is_no_failure(seen: Scene) -> None:
    seen.faults["camera"] = SystemFaultKind.RAISED
    seen.run(3.0)
    assert seen.news() == []


@pytest.mark.parametrize("state", [None, State.ERROR_PROCESSING, State.FINALIZED])
def test_a_component_without_a_run_or_in_an_error_has_failed(seen: Scene, state: State | None) -> None:
    seen.states["laser"] = state
    seen.run(3.0)
    assert seen.statuses() == [("laser", "FALSE")]


def test_a_component_that_is_removed_has_failed(seen: Scene) -> None:
    del seen.states["laser"]
    seen.run(3.0)
    assert seen.statuses() == [("laser", "FALSE")]


@pytest.mark.parametrize("state", [State.INACTIVE, State.UNCONFIGURED, State.DEACTIVATING])
def test_a_component_that_an_adaptation_deactivated_has_not_failed(seen: Scene, state: State) -> None:
    seen.states["camera"] = state
    seen.run(5.0)
    assert seen.news() == []


def test_a_component_may_take_its_time_to_start(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), first_within=4.0) as made:
        made.states["camera"] = None
        made.run(3.5)
        assert set(made.statuses()) == {("laser", "TRUE")}
        made.run(2.0)
        assert ("camera", "FALSE") in made.statuses()


def test_what_is_over_at_once_is_neither_failure_nor_recovery(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), failed_after=1.2, recovered_after=1.2) as made:
        made.run(6.0)
        made.faults["camera"] = SystemFaultKind.DIED
        made.run(1.0)
        made.faults.clear()
        made.run(3.0)
        assert set(made.statuses()) == {("camera", "TRUE"), ("laser", "TRUE")}
        made.faults["camera"] = SystemFaultKind.DIED
        made.run(2.0)
        made.faults.clear()
        made.run(1.0)
        made.faults["camera"] = SystemFaultKind.DIED
        made.run(2.0)
        found = made.statuses()
        assert ("camera", "RECOVERED") not in found
        assert ("camera", "FALSE") in found


def test_who_comes_later_is_informed_of_all_that_has_changed(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), period=2.0) as made:
        made.faults["camera"] = SystemFaultKind.DIED
        made.run(4.0)
        made.news()
        made.run(6.0)
        assert made.statuses() == [("camera", "FALSE"), ("laser", "TRUE")] * 3


def test_what_may_be_over_is_not_repeated(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), period=0.5, recovered_after=3.0) as made:
        made.faults["camera"] = SystemFaultKind.DIED
        made.run(4.0)
        made.faults.clear()
        made.news()
        made.run(2.0)
        assert {name for name, _ in made.statuses()} == {"laser"}
        made.run(2.0)
        assert ("camera", "RECOVERED") in made.statuses()


def test_a_faulty_sensor_is_a_failure_of_its_component(seen: Scene) -> None:
    seen.has_monitor = True
    seen.run(4.0)
    seen.sensors["picture"] = "black"
    seen.run(2.0)
    assert seen.statuses() == [("camera", "FALSE")]
    seen.sensors.clear()
    seen.run(3.0)
    assert seen.statuses() == [("camera", "RECOVERED")]


def test_a_sensor_that_nobody_answers_for_is_no_failure(seen: Scene) -> None:
    seen.has_monitor = True
    seen.sensors["scan"] = "silent"
    seen.run(6.0)
    assert seen.news() == []


def test_a_fault_that_is_ignored_is_no_failure(seen: Scene) -> None:
    seen.has_monitor = True
    seen.sensors["picture"] = "jumpy"
    seen.run(6.0)
    assert seen.news() == []


def test_an_inactive_sensor_is_silent_and_has_not_failed(seen: Scene) -> None:
    seen.has_monitor = True
    seen.states["camera"] = State.INACTIVE
    seen.run(2.0)
    seen.sensors["picture"] = "silent"
    seen.run(6.0)
    assert seen.news() == []
    seen.states["camera"] = State.ACTIVE
    seen.run(2.0)
    seen.sensors.clear()
    seen.run(6.0)
    assert seen.news() == []


def test_a_sensor_that_stays_silent_after_its_activation_has_failed(seen: Scene) -> None:
    seen.has_monitor = True
    seen.states["camera"] = State.INACTIVE
    seen.sensors["picture"] = "silent"
    seen.run(2.0)
    seen.states["camera"] = State.ACTIVE
    seen.run(6.0)
    assert seen.statuses() == [("camera", "FALSE")]


def test_a_failed_sensor_that_is_deactivated_stays_failed(seen: Scene) -> None:
    seen.has_monitor = True
    seen.run(4.0)
    seen.sensors["picture"] = "black"
    seen.run(2.0)
    seen.states["camera"] = State.INACTIVE
    seen.sensors.clear()
    seen.run(20.0)
    assert seen.statuses() == [("camera", "FALSE")]


def test_it_is_presumed_to_be_well_again_only_if_that_is_wanted(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), period=100.0, presumed_after=5.0, **PICTURES) as made:
        made.has_monitor = True
        made.run(4.0)
        made.sensors["picture"] = "black"
        made.news()
        made.run(2.0)
        made.states["camera"] = State.INACTIVE
        made.run(4.5)
        assert made.statuses() == [("camera", "FALSE")]
        made.run(3.0)
        assert made.statuses() == [("camera", "RECOVERED")]


@pytest.mark.parametrize("kind", KINDS)
def test_only_a_failure_of_its_own_is_presumed_to_be_over(tmp_path: Path, kind: SystemFaultKind) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), period=100.0, presumed_after=5.0) as made:
        made.run(2.0)
        made.news()
        made.states["laser"], made.faults["laser"] = State.UNCONFIGURED, kind
        made.run(4.5)
        assert made.statuses() == [("laser", "FALSE")]
        made.run(3.0)
        assert made.statuses() == ([("laser", "RECOVERED")] if kind is SystemFaultKind.FAILED else [])


def test_what_fails_again_while_it_is_tried_again_has_failed_for_as_long_once_more(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), period=1.0, presumed_after=5.0) as made:
        made.run(2.0)
        made.states["laser"], made.faults["laser"] = State.UNCONFIGURED, SystemFaultKind.FAILED
        for _ in range(2):
            made.fail_again()
            made.run(0.5)
            made.news()
            made.run(4.5)
            assert {status for name, status in made.statuses() if name == "laser"} == {"FALSE"}
            made.run(1.5)
            made.news()
            made.run(2.0)
            assert {status for name, status in made.statuses() if name == "laser"} == {"RECOVERED"}


def test_what_has_been_inactive_for_long_and_fails_has_failed(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), period=100.0, presumed_after=5.0) as made:
        made.states["laser"] = State.UNCONFIGURED
        made.run(8.0)
        made.news()
        made.faults["laser"] = SystemFaultKind.FAILED
        made.run(1.0)
        assert made.statuses() == [("laser", "FALSE")]


def test_old_news_of_sensors_change_nothing(seen: Scene) -> None:
    seen.has_monitor = True
    seen.run(4.0)
    seen.has_monitor = False
    seen.run(6.0)
    assert seen.news() == []


def test_an_inactive_observer_publishes_nothing_and_continues_with_what_it_knew(seen: Scene) -> None:
    seen.faults["camera"] = SystemFaultKind.DIED
    seen.run(2.0)
    seen.rig.transition("observer", Transition.DEACTIVATE)
    seen.news()
    seen.faults.clear()
    seen.run(2.0)
    assert seen.news() == []
    seen.rig.transition("observer", Transition.ACTIVATE)
    seen.run(3.0)
    assert ("camera", "RECOVERED") in seen.statuses()


def test_a_further_run_continues_with_what_the_earlier_one_knew(seen: Scene) -> None:
    seen.faults["camera"] = SystemFaultKind.DIED
    seen.run(2.0)
    earlier = seen.rig.runtimes["observer"].component
    assert isinstance(earlier, ComponentObserver)
    known = earlier.snapshot()
    seen.rig.transition("observer", Transition.DEACTIVATE)
    seen.faults.clear()
    later = seen.rig.add(ComponentObserver, "later", {"observed": earlier.observed}, state=State.INACTIVE)
    later.restore(known)
    seen.rig.transition("later", Transition.ACTIVATE)
    seen.news()
    seen.run(3.0)
    assert ("camera", "RECOVERED") in seen.statuses()


def test_a_further_run_repeats_what_the_earlier_one_knew_only_with_evidence(seen: Scene) -> None:
    earlier = seen.rig.runtimes["observer"].component
    assert isinstance(earlier, ComponentObserver)
    known = earlier.snapshot()
    seen.rig.transition("observer", Transition.DEACTIVATE)
    seen.faults["camera"] = SystemFaultKind.FAILED
    given = {"observed": earlier.observed, "period": 1000.0}
    later = seen.rig.add(ComponentObserver, "later", given, state=State.INACTIVE)
    later.restore(known)
    seen.rig.transition("later", Transition.ACTIVATE)
    seen.news()
    seen.rig.advance(1.0)
    seen.run(1.5)
    assert seen.statuses() == [("laser", "TRUE"), ("camera", "FALSE")]


def test_an_observer_that_is_swapped_twice_before_it_is_activated_has_forgotten_no_failure(seen: Scene) -> None:
    seen.has_monitor = True
    seen.run(4.0)
    seen.sensors["picture"] = "black"
    seen.run(2.0)
    earlier = seen.rig.runtimes["observer"].component
    assert isinstance(earlier, ComponentObserver)
    known = earlier.snapshot()
    seen.rig.transition("observer", Transition.DEACTIVATE)
    seen.states["camera"] = State.INACTIVE
    seen.news()
    given = {"observed": earlier.observed, "period": 1000.0}
    for name in ("second", "third"):
        later = seen.rig.add(ComponentObserver, name, given, state=State.INACTIVE)
        later.restore(known)
        known = later.snapshot()
    seen.rig.transition("third", Transition.ACTIVATE)
    seen.run(3.0)
    assert seen.statuses() == [("camera", "FALSE"), ("laser", "TRUE")]


def failed_at_rest(made: Scene) -> None:
    """Have the laser fail by itself, and end inactive."""
    made.run(2.0)
    made.states["laser"], made.faults["laser"] = State.UNCONFIGURED, SystemFaultKind.FAILED


def run_again(made: Scene, **parameters: float) -> None:
    """Replace the observer by a further run of it, which is given what the earlier one knew."""
    earlier = made.rig.runtimes["observer"].component
    assert isinstance(earlier, ComponentObserver)
    known = codec.unpack_plain(codec.pack_plain(earlier.snapshot()))
    made.rig.transition("observer", Transition.DEACTIVATE)
    given = {"observed": earlier.observed, "period": 100.0, **parameters}
    later = made.rig.add(ComponentObserver, "later", given, state=State.INACTIVE)
    later.restore(known)
    made.rig.transition("later", Transition.ACTIVATE)
    made.news()


def test_what_is_presumed_to_be_over_is_so_for_a_further_run_too(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), period=100.0, presumed_after=5.0) as made:
        failed_at_rest(made)
        made.run(8.0)
        assert made.statuses()[-1] == ("laser", "RECOVERED")
        run_again(made, presumed_after=5.0)
        made.run(12.0)
        assert ("laser", "FALSE") not in made.statuses()
        made.fail_again()
        made.run(1.0)
        assert made.statuses() == [("laser", "FALSE")]


def test_the_inactive_time_of_what_has_failed_counts_over_a_further_run(tmp_path: Path) -> None:
    with scene(ComponentObserver, observed=written(tmp_path), period=100.0, presumed_after=8.0) as made:
        failed_at_rest(made)
        made.run(6.0)
        run_again(made, presumed_after=8.0)
        made.run(1.0)
        assert ("laser", "RECOVERED") not in made.statuses()
        made.run(3.5)
        assert ("laser", "RECOVERED") in made.statuses()


def test_it_measures_how_many_have_failed(seen: Scene) -> None:
    seen.faults = {"camera": SystemFaultKind.DIED, "laser": SystemFaultKind.HUNG}
    measured = seen.rig.collect_qualities("observer")
    seen.run(3.0)
    assert measured[-1].values == {"failures": 2.0}
