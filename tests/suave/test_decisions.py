"""SUAVE's designs are chosen by the visibility of the water and by the thrusters, as its ontology has it."""

from __future__ import annotations

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.skills.generators.writing import generated
from regraft.adaptation_manager.planners.metacontrol.skills.reading import checked_skills
from regraft.stack import load
from regraft.stacks.suave.monitors import THRUSTERS, thruster_name
from tests.suave.deciding import MOTION, SEARCH, SKILLS, decided, situation
from tests.support.paths import SUAVE

ALTITUDES = ("fd_spiral_high", "fd_spiral_medium", "fd_spiral_low")
BOUNDARIES = (
    (3.75, "fd_spiral_high"),
    (3.25, "fd_spiral_high"),
    (3.2499, "fd_spiral_medium"),
    (2.25, "fd_spiral_medium"),
    (2.2499, "fd_spiral_low"),
    (1.25, "fd_spiral_low"),
    (1.2499, None),
    (0.0, None),
)


def test_the_generated_files_are_those_of_the_skills() -> None:
    checked = checked_skills(SKILLS, load(SUAVE / "stack.yaml").architecture)
    assert [each for each in checked.diagnostics if each.severity.value == "error"] == []
    files = {file.name: file.read_text() for file in (SUAVE / "metacontrol").iterdir()}
    assert files == generated(checked.skills)


@pytest.mark.parametrize("present", ALTITUDES)
@pytest.mark.parametrize(("visibility", "expected"), BOUNDARIES)
@pytest.mark.parametrize("measured_under", [MOTION, SEARCH])
def test_the_search_is_as_high_as_the_water_lets_it_from_each_threshold_on(
    present: str, visibility: float, expected: str | None, measured_under: str
) -> None:
    seen = situation("fd_all_thrusters", present, visibility, measured_under=measured_under)
    designs, _ = decided(seen)
    assert designs == {MOTION: "fd_all_thrusters", SEARCH: expected}


def test_a_design_that_needs_to_see_farther_is_in_error_and_one_that_does_not_is_in_progress() -> None:
    states = [
        decided(situation("fd_all_thrusters", "fd_spiral_medium", visibility, measured_under=SEARCH))[1][SEARCH]
        for visibility in (2.2499, 2.25)
    ]
    assert states == [Status.IN_ERROR_NFR, Status.IN_PROGRESS]


def test_the_most_useful_search_is_chosen_while_nothing_was_measured() -> None:
    assert decided(situation("fd_all_thrusters", "fd_spiral_low", None))[0][SEARCH] == "fd_spiral_high"


@pytest.mark.parametrize("number", range(1, THRUSTERS + 1))
def test_any_thruster_that_fails_is_recovered_and_the_search_stays(number: int) -> None:
    seen = situation("fd_all_thrusters", "fd_spiral_low", 1.5, (thruster_name(number),))
    designs, states = decided(seen)
    assert designs == {MOTION: "fd_recover_thrusters", SEARCH: "fd_spiral_low"}
    assert states[MOTION] is Status.IN_ERROR_COMPONENT


def test_several_thrusters_that_fail_are_recovered_by_the_same_design() -> None:
    every = tuple(thruster_name(number) for number in range(1, THRUSTERS + 1))
    designs, _ = decided(situation("fd_recover_thrusters", "fd_spiral_high", 3.5, every))
    assert designs == {MOTION: "fd_recover_thrusters", SEARCH: "fd_spiral_high"}


def test_a_failing_thruster_and_murky_water_are_answered_in_one_decision() -> None:
    designs, _ = decided(situation("fd_all_thrusters", "fd_spiral_high", 1.3, (thruster_name(3),)))
    assert designs == {MOTION: "fd_recover_thrusters", SEARCH: "fd_spiral_low"}
