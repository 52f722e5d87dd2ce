"""Planners decide by themselves: at intervals, on faults, and when a requirement turns."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.bus_schema.model.adaptation import Outcome
from tests.planners.decisions.deciding import (
    LOST,
    PACE,
    PLANNERS,
    bench,
    both,
)


@both
def test_it_decides_by_itself_at_fixed_intervals(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {every: 2}\n") as on:
        on.dark(0.95, seconds=1.5)
        assert on.manager.requests == []
        on.dark(0.95, seconds=1.0)
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("every 2 s; ")


@both
def test_it_decides_when_a_fault_comes_and_when_it_is_gone(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_fault: true}\n") as on:
        on.dark(0.2, seconds=1.0)
        assert on.manager.requests == []
        on.dark(0.95, seconds=1.0)
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("fault blind has come; ")
        if name == "forecast":
            on.dark(0.2, seconds=1.0)
            assert on.paces == [0.1, 0.26]
            assert on.reasons[1].startswith("fault blind is gone; ")


@both
def test_it_decides_when_a_requirement_turns(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_requirement: [MoveSafely]}\n") as on:
        on.requires(True)
        on.dark(0.95, seconds=1.0)
        assert on.manager.requests == []
        on.requires(False)
        on.dark(0.95, seconds=1.0)
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("requirement MoveSafely is not met; ")


@both
def test_a_decision_that_cannot_be_taken_is_told_once_and_the_planner_lives_on(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {every: 1}\n") as on:
        on.manager.fates = ["blind"]
        on.dark(0.2, seconds=5.0)
        told = [event for event in on.rig.events if event.kind == "planner.undecided"]
        assert len(told) == 1
        assert "the journal cannot be read" in told[0].text
        on.manager.fates = []
        on.dark(0.95, seconds=2.0)
        assert on.paces == [0.1]


@both
def test_trouble_that_comes_again_after_a_success_is_told_again(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {every: 1}\n") as on:
        for fates in (["blind"], [], ["blind"]):
            on.manager.fates = list(fates)
            on.dark(0.2, seconds=2.5)
        assert len([event for event in on.rig.events if event.kind == "planner.undecided"]) == 2


@both
def test_a_fault_during_which_the_manager_could_not_be_asked_is_decided_upon_afterwards(
    tmp_path: Path, name: str
) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_fault: true}\n") as on:
        on.manager.fates = ["blind"]
        on.dark(0.95, seconds=1.0)
        assert on.paces == []
        on.manager.fates = []
        on.dark(0.95, seconds=3.0)
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("fault blind has come; ")


@both
@pytest.mark.parametrize("fate", [Outcome.ROLLED_BACK, "refused"])
def test_a_decision_on_a_fault_that_was_not_carried_out_is_told_and_taken_again(
    tmp_path: Path, name: str, fate: Outcome | str
) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_fault: true}\n") as on:
        on.manager.fates = [fate]
        on.dark(0.95, seconds=0.5)
        assert on.paces == [0.1]
        (told,) = [event for event in on.rig.events if event.kind == "planner.undecided"]
        assert ("the queue is full" if fate == "refused" else "rolled_back") in told.text
        on.dark(0.95, seconds=3.0)
        assert on.paces == [0.1, 0.1]
        assert on.reasons[1].startswith("fault blind has come; ")


@both
def test_a_requirement_during_which_the_manager_could_not_be_asked_is_decided_upon_afterwards(
    tmp_path: Path, name: str
) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_requirement: [MoveSafely]}\n") as on:
        on.manager.fates = ["blind"]
        on.requires(False)
        on.dark(0.95, seconds=1.0)
        on.manager.fates = []
        on.dark(0.95, seconds=3.0)
        assert on.paces == [0.1]


@both
def test_a_fault_that_has_gone_undecided_is_no_reason_any_more(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_fault: true}\n") as on:
        on.manager.fates = ["blind"]
        on.dark(0.95, seconds=0.5)
        on.dark(0.2, seconds=0.3)
        on.manager.fates = []
        on.dark(0.2, seconds=3.0)
        assert [reason for reason in on.reasons if "has come" in reason] == []


def test_a_forecast_that_starts_amid_a_fault_decides_once_it_knows_enough(tmp_path: Path) -> None:
    with bench(tmp_path, "forecast", LOST + "triggers: {on_fault: true}\n") as on:
        on.fails("wheels")
        on.rig.advance(1.0)
        assert on.manager.requests == []
        on.dark(0.2, seconds=2.0)
        assert on.paces == [0.1]


@both
def test_what_a_fault_prescribes_is_chosen_though_nothing_can_be_expected(tmp_path: Path, name: str) -> None:
    prescribed = LOST.replace("excludes: {pace: [0.18, 0.26]}", "prescribes: {pace: 0.1}")
    with bench(tmp_path, name, prescribed + "triggers: {on_fault: true}\n") as on:
        on.fails("wheels")
        on.rig.advance(1.0)
        assert on.paces == [0.1]
        found = on.propose(apply=False).choice
        assert found["option"] == {"pace": 0.1}
        assert "the prescribed solution is not possible" not in " ".join(map(str, found["notes"]))


@both
def test_a_fault_holds_from_the_failure_of_its_component_to_its_recovery(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, LOST) as on:
        on.dark(0.2)
        assert "fault blind counts as absent: stuck is not known" in on.propose(apply=False).choice["notes"]
        for failed, faults in (((), []), (("wheels", "camera"), ["blind"]), (("camera",), [])):
            on.fails(*failed)
            assert on.propose(apply=False).choice["faults"] == faults


@both
def test_it_decides_at_once_when_a_component_fails(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, LOST + "triggers: {on_fault: true}\n") as on:
        on.dark(0.2, seconds=1.0)
        on.fails("camera")
        assert on.manager.requests == []
        on.fails("camera", "wheels")
        assert on.paces == [0.1]
        assert on.reasons[0].startswith("fault blind has come; ")


@both
def test_a_planner_that_starts_amid_a_fault_decides(tmp_path: Path, name: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_fault: true}\n") as on:
        on.dark(0.95, seconds=1.0)
        assert on.paces == [0.1]


@both
@pytest.mark.parametrize("unknown", ["another", "unsatisfiable"])
def test_a_requirement_that_is_not_known_is_no_reason_to_decide(tmp_path: Path, name: str, unknown: str) -> None:
    with bench(tmp_path, name, PACE + "triggers: {on_requirement: [MoveSafely]}\n") as on:
        on.dark(0.95)
        on.requires(None) if unknown == "unsatisfiable" else on.requires(False, "another")
        on.rig.advance(1.0)
        assert on.manager.requests == []


@both
def test_a_planner_reads_of_the_system_only_what_its_decisions_speak_of(tmp_path: Path, name: str) -> None:
    def topics(text: str) -> set[str]:
        (tmp_path / "pace.yaml").write_text(text)
        ports = PLANNERS[name].ports_for({"decisions": str(tmp_path)})
        return {port.topic for port in ports if port.topic and port.topic.startswith("system/")}

    plain = PACE.replace("  safely: {requirement: MoveSafely}\n", "")
    assert topics(plain) == set()
    assert topics(PACE) == {"system/qualities"}
    assert topics(LOST) == {"system/qualities", "system/faults"}
