"""Each test is the opposite of a published defect of the reasoner."""

from __future__ import annotations

from pathlib import Path

import pytest

from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Status
from regraft.adaptation_manager.planners.metacontrol.reasoning.assessment import Against, Assessment
from tests.metacontrol.owl import (
    ENERGY,
    LASER,
    NAVIGATE,
    PERFORMANCE,
    SAFETY,
    design,
    individual,
    iri,
    quality,
    write,
)
from tests.metacontrol.reasoning.cycle import FAILED, RECOVERED, Cycle, objective

FAST = design("fast", NAVIGATE, {PERFORMANCE: 0.9, SAFETY: 0.2, ENERGY: 0.9})
SLOW = design("slow", NAVIGATE, {PERFORMANCE: 0.4, SAFETY: 0.9, ENERGY: 0.3})


def assessment(cycle: Cycle, name: str, of: str = "drive") -> Assessment:
    """Return what was considered of a design in the last cycle."""
    return next(each for each in cycle.decision(of).assessments if each.design == iri(name))


def kinds(cycle: Cycle, name: str, of: str = "drive") -> list[Against]:
    """Return what speaks against a design."""
    return [each.kind for each in assessment(cycle, name, of).against]


def test_b1_what_breaks_a_requirement_is_not_selected(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, FAST, SLOW), objective(bounds={SAFETY: 0.7, ENERGY: 0.5}))
    assert cycle.design() == "slow"
    assert kinds(cycle, "fast") == [Against.REQUIREMENT, Against.REQUIREMENT]


@pytest.mark.parametrize("order", [(SAFETY, ENERGY), (ENERGY, SAFETY)])
def test_b2_every_requirement_is_tested_on_every_design(tmp_path: Path, order: tuple[str, str]) -> None:
    bounds = {SAFETY: 0.7, ENERGY: 0.5}
    wasteful = design("wasteful", NAVIGATE, {PERFORMANCE: 1.0, SAFETY: 1.0, ENERGY: 0.9})
    unsafe = design("unsafe", NAVIGATE, {PERFORMANCE: 1.0, SAFETY: 0.1, ENERGY: 0.1})
    cycle = Cycle(
        write(tmp_path, FAST, wasteful, unsafe, SLOW), objective(bounds={name: bounds[name] for name in order})
    )
    assert cycle.design() == "slow"
    assert kinds(cycle, "wasteful") == kinds(cycle, "unsafe") == [Against.REQUIREMENT]


def test_b3_the_direction_is_data_and_no_name_of_a_quality_is_special(tmp_path: Path) -> None:
    parts = (
        quality("noise", "LOWER", 1.0),
        quality("light", "HIGHER", 1.0),
        design("loud", NAVIGATE, {"noise": 0.9, "light": 0.9}),
        design("dark", NAVIGATE, {"noise": 0.1, "light": 0.1}),
        design("calm", NAVIGATE, {"noise": 0.3, "light": 0.5}),
    )
    cycle = Cycle(write(tmp_path, *parts), objective(bounds={"noise": 0.5, "light": 0.5}))
    assert cycle.design() == "calm"
    cycle.measure("noise", 0.6)
    assert cycle.design() is None, "measured above the bound of a quality of which less is better"


def test_b4_a_utility_of_zero_or_below_is_legal(tmp_path: Path) -> None:
    zero = design("zero", NAVIGATE, {PERFORMANCE: 0.0})
    below = design("below", NAVIGATE, {ENERGY: 0.5})
    weights = {PERFORMANCE: 1.0, ENERGY: 0.0}
    assert Cycle(write(tmp_path, zero), objective(weights=weights)).design() == "zero"
    cycle = Cycle(write(tmp_path, below), objective(weights={ENERGY: 1.0}))
    assert cycle.design() == "below"
    assert assessment(cycle, "below").utility == -0.5


def test_b4_of_equal_designs_the_present_one_stays_and_the_first_of_the_file_is_selected(tmp_path: Path) -> None:
    parts = [design(name, NAVIGATE, {PERFORMANCE: 0.5}, ("nav:camera",) if name == "b" else ()) for name in "cba"]
    parts[2] = design("a", NAVIGATE, {PERFORMANCE: 0.5})
    cycle = Cycle(write(tmp_path, *parts), objective(always_improve=True))
    assert cycle.design() == "c", "the first in the file, not by name"
    other = Cycle(write(tmp_path, *parts), objective(begin="a", always_improve=True))
    assert other.design() == "a"
    assert other.design() == "a", "the present one"


def test_b5_without_a_measurement_there_is_no_violation(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, SLOW, FAST), objective(bounds={SAFETY: 0.7}))
    cycle.run()
    assert cycle.analyse().objectives[iri("drive")].status is Status.IN_PROGRESS
    cycle.measure(ENERGY, 0.9)
    assert cycle.analyse().objectives[iri("drive")].status is Status.IN_PROGRESS, "no requirement on it"


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_b5_a_measurement_that_is_no_finite_number_is_unknown(tmp_path: Path, value: float) -> None:
    cycle = Cycle(write(tmp_path, SLOW, FAST), objective(bounds={SAFETY: 0.7}))
    cycle.run()
    cycle.measure(SAFETY, value)
    assert cycle.analyse().objectives[iri("drive")].status is Status.IN_PROGRESS


@pytest.mark.parametrize("bound", [float("nan"), float("inf"), "high", True])
def test_b11_a_bound_that_is_no_number_is_refused(tmp_path: Path, bound: float) -> None:
    cycle = Cycle(write(tmp_path, SLOW), objective(bounds={SAFETY: bound}))
    assert cycle.design() is None
    assert cycle.decision().refused == (f"the bound of 'safety' is {bound!r}, must be a number",)


def test_b6_a_missing_estimate_is_reported_and_meets_no_requirement(tmp_path: Path) -> None:
    partial = design("partial", NAVIGATE, {PERFORMANCE: 1.0})
    cycle = Cycle(write(tmp_path, partial, SLOW), objective(bounds={SAFETY: 0.5}))
    assert cycle.design() == "slow"
    assert kinds(cycle, "partial") == [Against.NO_ESTIMATE]
    assert set(assessment(cycle, "partial").missing) == {iri(SAFETY), iri(ENERGY)}
    free = Cycle(write(tmp_path, partial, SLOW), objective())
    assert free.design() == "partial"
    assert assessment(free, "partial").utility == pytest.approx(1.0 - 0.2), "the worst energy, the worst safety"
    assert "  unknown: no estimate of safety; its worst value counts" in assessment(free, "partial").lines()


def test_b6_a_design_that_breaks_two_requirements_is_rejected_once(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, FAST, SLOW), objective(bounds={SAFETY: 0.1}))
    assert cycle.design() == "fast"
    cycle = Cycle(write(tmp_path, FAST, SLOW), objective(bounds={SAFETY: 0.1, ENERGY: 0.95}))
    cycle.run()
    cycle.measure(SAFETY, 0.0)
    cycle.measure(ENERGY, 1.0)
    assert cycle.design() == "slow"
    assert [rest.design for rest in cycle.resting.all(cycle.now)] == [iri("fast")]


@pytest.mark.parametrize(
    ("bounds", "measured", "status"),
    [
        ({SAFETY: 0.5}, (SAFETY, 0.5), Status.IN_PROGRESS),
        ({SAFETY: 0.5}, (SAFETY, 0.5 - 1e-12), Status.IN_ERROR_NFR),
        ({SAFETY: 0.5}, (SAFETY, 0.9), Status.IN_PROGRESS),
        ({ENERGY: 0.5}, (ENERGY, 0.5), Status.IN_PROGRESS),
        ({ENERGY: 0.5}, (ENERGY, 0.5 + 1e-12), Status.IN_ERROR_NFR),
        ({ENERGY: 0.5}, (ENERGY, 0.1), Status.IN_PROGRESS),
    ],
)
def test_b7_a_measurement_is_an_error_on_the_wrong_side_of_its_bound_alone(
    tmp_path: Path, bounds: dict[str, float], measured: tuple[str, float], status: Status
) -> None:
    cycle = Cycle(write(tmp_path, SLOW), objective(bounds=bounds))
    cycle.run()
    cycle.measure(*measured)
    assert cycle.analyse().objectives[iri("drive")].status is status


@pytest.mark.parametrize(("bound", "selected"), [(0.9, True), (0.9 + 1e-12, False)])
def test_b7_an_estimate_on_its_bound_meets_it(tmp_path: Path, bound: float, selected: bool) -> None:
    cycle = Cycle(write(tmp_path, SLOW), objective(bounds={SAFETY: bound}))
    assert (cycle.design() == "slow") is selected
    assert cycle.decision().status is (Status.IN_PROGRESS if selected else Status.IN_ERROR_NFR)


def test_b9_nothing_is_left_of_a_conclusion_when_its_cause_is_gone(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, design("d", NAVIGATE, {}, (LASER,))), objective())
    cycle.run()
    before = cycle.analyse()
    cycle.set_components(laser_resender=FAILED)
    assert cycle.analyse().unrealisable == {iri("d")}
    cycle.set_components(laser_resender=RECOVERED)
    after = cycle.analyse()
    assert after.unrealisable == frozenset()
    assert after.objectives[iri("drive")].status is before.objectives[iri("drive")].status


def test_b9_only_objectives_that_a_recovered_component_may_serve_are_updated(tmp_path: Path) -> None:
    path = write(tmp_path, design("d", NAVIGATE, {}, (LASER,)), design("r", "nav:to_recharge", {}))
    cycle = Cycle(path, objective(), objective("charge", "nav:to_recharge"))
    cycle.set_components(laser_resender=RECOVERED)
    states = cycle.analyse().objectives
    assert states[iri("drive")].updatable
    assert not states[iri("charge")].updatable
    reason = cycle.analysis.why_updatable(iri("drive"))
    assert reason is not None
    assert reason.rule == "recovered-component"


def test_b10_a_name_that_ends_alike_is_another(tmp_path: Path) -> None:
    path = write(tmp_path, design("xf_a", NAVIGATE, {PERFORMANCE: 0.1}), design("f_a", NAVIGATE, {PERFORMANCE: 0.9}))
    cycle = Cycle(path, objective(begin="f_a"), objective("second", begin="xf_a"))
    cycle.run()
    assert cycle.decision("drive").design == iri("f_a")
    assert cycle.decision("second").design == iri("xf_a")
    cycle.report_error(Status.IN_ERROR_FR, "second")
    cycle.run()
    assert cycle.decision("drive").design == iri("f_a")
    assert [rest.design for rest in cycle.resting.all(cycle.now)] == [iri("xf_a")]


def test_b11_an_objective_without_a_meaning_is_refused_with_reasons_and_others_are_decided(tmp_path: Path) -> None:
    cycle = Cycle(
        write(tmp_path, SLOW),
        objective("odd", "nav:to_fly", bounds={"mros:sfety": 0.1}),
        objective(bounds={SAFETY: 0.1}),
    )
    assert cycle.design() == "slow"
    odd = cycle.decision("odd")
    assert odd.design is None
    assert odd.refused == (
        "there is no function 'to_fly'; there are: to_navigate, to_recharge",
        "there is no quality 'sfety'; did you mean 'safety'?",
    )


def test_b12_the_design_that_an_objective_asks_for_is_the_first(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, FAST, SLOW), objective(begin="slow"))
    assert cycle.design() == "slow"
    assert assessment(cycle, "fast").against[0].why == "slow is the design asked for, and was kept"
    assert cycle.design() == "slow", "nothing is in error"


def test_b12_a_design_that_is_asked_for_must_meet_the_requirements(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, FAST, SLOW), objective(begin="fast", bounds={SAFETY: 0.5}))
    assert cycle.design() == "slow"
    assert assessment(cycle, "fast").against[0].why == "safety is estimated 0.2, must be >= 0.5"


def test_a_design_that_is_the_rest_configuration_is_never_selected(tmp_path: Path) -> None:
    rest = design("rest", NAVIGATE, {PERFORMANCE: 1.0, SAFETY: 1.0, ENERGY: 0.0}, mros__fd_is_rest=True)
    assert Cycle(write(tmp_path, rest, SLOW), objective()).design() == "slow"


def test_a_function_without_a_design_in_the_context_has_none(tmp_path: Path) -> None:
    cycle = Cycle(write(tmp_path, SLOW), objective(function="nav:to_recharge"))
    assert cycle.design() is None
    assert cycle.decision().status is Status.IN_ERROR_FR
    assert cycle.decision().why == "its function has no design in this context"


def test_improvement_needs_a_margin(tmp_path: Path) -> None:
    parts = (
        design("present", NAVIGATE, {PERFORMANCE: 0.50}),
        design("bit", NAVIGATE, {PERFORMANCE: 0.54}, ("nav:camera",)),
        design("much", NAVIGATE, {PERFORMANCE: 0.60}, (LASER,)),
        individual("nav:camera", tomasys__c_status="TRUE"),
    )
    cycle = Cycle(write(tmp_path, *parts), objective(begin="present", always_improve=True))
    cycle.set_components(laser_resender=FAILED)
    assert cycle.design() == "present"
    assert cycle.design() == "present", "0.04 is within the margin"
    assert assessment(cycle, "bit").against[0].why == "present is the present design, and was kept"
    cycle.set_components(laser_resender=RECOVERED)
    assert cycle.design() == "much"
