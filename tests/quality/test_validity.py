"""Metrics have a value, a time, and are unknown where nothing is known: nobody decides on old or invented numbers."""

from __future__ import annotations

import math
from typing import Any

import pytest

from behavior_tree import Input, Status
from regraft.services.bt_executor.quality import TaskLevelQR
from tests.quality.helpers import Field, task

OUTPUTS = {"metric": "{metric}", "mean_metric": "{mean}", "out_status": "{status}"}


def fields(**ports: str) -> Field:
    """Return a requirement of {@speed}."""
    return Field(task(value="{@speed}", at_least="1", **OUTPUTS, **ports))


def test_without_data_nothing_is_known_and_no_number_invented() -> None:
    field = fields()
    field.tick()
    told = field.quality("QR")
    assert (told.metric, told.measured, told.mean, told.satisfied, told.degree) == (None,) * 5
    assert (told.status, told.active, told.reason) == ("unknown", True, "there are no data in '@speed'")
    assert (field.get("metric"), field.get("mean"), field.get("status")) == (None, None, "unknown")


def test_a_measure_has_the_time_of_its_data() -> None:
    field = fields()
    field.clock.advance(3.0)
    field.put("speed", 2.0)
    field.tick(0.5)
    assert (field.quality("QR").stamp, field.quality("QR").measured, field.quality("QR").metric) == (3.5, 3.0, 2.0)


def test_stale_data_empty_the_metric_and_fresh_ones_fill_it_again() -> None:
    field = fields(stale_after="1")
    field.put("speed", 2.0)
    field.tick(1.0)
    assert (field.get("metric"), field.get("status")) == (2.0, "satisfied")
    field.tick(0.1)
    assert (field.get("metric"), field.get("status")) == (None, "unknown")
    assert "more than 1 s old" in field.quality("QR").reason
    field.put("speed", 0.5)
    field.tick()
    assert (field.get("metric"), field.get("status")) == (0.5, "violated")


def test_the_age_that_the_reflection_tells_counts_more_than_when_the_entry_was_written() -> None:
    field = fields(stale_after="1")
    field.put("speed", 2.0)
    field.put("speed_age", 0.9)
    field.tick(5.0)
    assert field.quality("QR").satisfied is True
    assert field.quality("QR").measured == pytest.approx(4.1)
    field.put("speed", 2.0)
    field.put("speed_age", 1.1)
    field.tick()
    assert field.quality("QR").status == "unknown"


def test_what_the_reflection_calls_stale_is_stale() -> None:
    field = fields()
    field.put("speed", 2.0)
    field.put("speed_stale", True)
    field.tick()
    assert (field.quality("QR").status, field.quality("QR").reason) == ("unknown", "the data in '@speed' are stale")
    field.put("speed_stale", False)
    field.tick()
    assert field.quality("QR").status == "satisfied"


def test_the_age_is_found_from_a_sub_tree_that_has_the_entry_under_another_name() -> None:
    inner = task(value="{v}", stale_after="1")
    others = f'<BehaviorTree ID="Sub">{inner}</BehaviorTree>'
    field = Field('<SubTree ID="Sub" v="{@speed}"/>', others=others, board={"speed": 1.0, "speed_age": 2.0})
    field.tick()
    assert field.quality("QR").status == "unknown"


@pytest.mark.parametrize("value", ["a text", [1.0], "nan"])
def test_data_that_are_no_numbers_are_unknown(value: Any) -> None:
    field = fields()
    field.put("speed", value)
    assert field.tick() == "R"
    assert (field.quality("QR").metric, field.quality("QR").status) == (None, "unknown")


@pytest.mark.parametrize("weight", [-1.0, math.inf, math.nan])
def test_an_impossible_weight_is_unknown(weight: float) -> None:
    field = fields(weight="{w}")
    field.put("speed", 1.0)
    field.put("w", weight)
    assert field.tick() == "R"
    assert "weight" in field.quality("QR").reason


@pytest.mark.parametrize("value", [math.inf, -math.inf, 1e308])
def test_numbers_without_end_are_never_told(value: float) -> None:
    field = fields()
    field.put("speed", value)
    for _ in range(30):
        field.tick(1e6)
    for told in field.ear.heard:
        assert all(number is None or math.isfinite(number) for number in (told.metric, told.mean))


def test_the_last_of_a_run_stays_but_is_not_active() -> None:
    field = Field(task("<Spelt script='RS'/>", value="{@speed}", at_least="1", **OUTPUTS), board={"speed": 2.0})
    field.tick()
    field.tick(1.0)
    assert (field.get("metric"), field.get("status")) == (2.0, "satisfied")
    assert (field.quality("QR").active, field.quality("QR").metric) == (False, 2.0)


@pytest.mark.parametrize("script", ["RS", "RF", "RK"])
def test_a_requirement_is_active_only_while_its_child_runs(script: str) -> None:
    field = Field(task(f"<Spelt script='{script}'/>", value="1"))
    field.tick()
    assert field.quality("QR").active
    field.tick()
    assert not field.quality("QR").active
    field.tick()
    assert field.quality("QR").active


def test_a_requirement_of_a_halted_task_is_not_active() -> None:
    field = Field(task(value="1"))
    field.tick()
    field.tree.halt_tree()
    assert not field.quality("QR").active


def test_a_mean_is_over_the_time_for_which_the_task_ran() -> None:
    parts = task("<Spelt script='RRS'/>", value="{@speed}", **OUTPUTS)
    field = Field(f"<Sequence>{parts}<Spelt script='RRS'/></Sequence>", board={"speed": 1.0})
    field.tick()
    field.put("speed", 4.0)
    field.tick(1.0)
    field.tick(2.0)
    assert field.quality("QR").mean == field.get("mean") == pytest.approx((1.0 + 8.0) / 3.0)
    field.tick(100.0)
    field.tick(100.0)
    field.put("speed", 0.0)
    field.tick()
    field.tick(3.0)
    assert field.get("mean") == pytest.approx(9.0 / 6.0)


class Leg(TaskLevelQR):
    """Counts what it is given, and says so at the end."""

    attribute = "Effort"
    higher_is_better = False
    amount = Input(float)
    limit = Input(float, default=10.0)

    def on_start(self) -> None:
        """Begin anew."""
        self.total = 0.0

    def measure(self) -> float | None:
        """Add up; nothing is known before the end."""
        self.total += self.amount
        return None

    def on_end(self, status: Status) -> float | None:
        """Return the sum."""
        return self.total + self.amount

    def is_satisfied(self, metric: float) -> bool:
        """Return whether it is little enough."""
        return metric <= self.limit

    def status_text(self, metric: float | None, satisfied: bool | None) -> str:
        """Return words."""
        return "counting" if metric is None else f"{metric:g} of {self.limit:g}"


def test_a_class_may_give_a_last_metric_with_each_end() -> None:
    leg = '<Leg amount="{@n}" limit="5" weight="3" metric="{m}" out_status="{s}"><Spelt script="RRSRF"/></Leg>'
    field = Field(leg, Leg, board={"n": 1.0})
    field.tick()
    assert (field.get("m"), field.get("s"), field.quality("Leg").satisfied) == (None, "counting", None)
    field.tick(1.0)
    field.tick(1.0)
    told = field.quality("Leg")
    assert (field.get("m"), field.get("s"), told.satisfied, told.degree) == (3.0, "3 of 5", True, 1.0)
    assert (told.attribute, told.weight, told.higher_is_better, told.active) == ("Effort", 3.0, False, False)
    field.put("n", 4.0)
    field.tick()
    field.tick()
    assert (field.get("m"), field.quality("Leg").satisfied, field.quality("Leg").degree) == (8.0, False, 0.0)


def test_no_last_metric_is_given_for_a_task_that_was_halted() -> None:
    field = Field('<Leg amount="{@n}" metric="{m}"><Spelt/></Leg>', Leg, board={"n": 1.0})
    field.tick()
    field.tree.halt_tree()
    assert field.get("m") is None


def test_a_class_that_fixes_its_attribute_is_not_given_another() -> None:
    with pytest.raises(Exception, match="is about Effort; leave quality_attribute out"):
        Field('<Leg amount="1" quality_attribute="Power"><Spelt/></Leg>', Leg)


def test_the_attribute_may_be_any_name_even_from_the_blackboard() -> None:
    field = Field(task(value="1", quality_attribute="{what}"), board={"what": "Tidiness"})
    field.tick()
    assert field.quality("QR").attribute == "Tidiness"


def test_a_port_that_would_hide_a_part_of_the_base_class_is_refused() -> None:
    with pytest.raises(TypeError, match="level hides an attribute"):

        class Light(TaskLevelQR):
            """Has a port of a name that is taken."""

            level = Input(float)  # type: ignore[assignment]


def test_a_script_that_asks_the_status_first_never_meets_an_empty_metric() -> None:
    asks = """<ScriptCondition code="status == 'unknown' ? false : metric &lt; 0.1"/>"""
    measured = task(value="{@speed}", **OUTPUTS)
    field = Field(f"<ParallelAll>{measured}<KeepRunningUntilFailure>{asks}</KeepRunningUntilFailure></ParallelAll>")
    assert field.tick() == "R"
    field.put("speed", 0.05)
    assert field.tick() == "R"


@pytest.mark.parametrize(("script", "letter"), [("S", "S"), ("F", "F")])
def test_a_child_that_is_done_in_one_tick_is_measured(script: str, letter: str) -> None:
    child = f"<Spelt script='{script}'/>"
    field = Field(
        task(child, value="{speed}", at_least="2", metric="{m}", mean_metric="{mean}", out_status="{o}"),
        board={"speed": 3.0},
    )
    assert field.tick() == letter
    assert (field.get("m"), field.get("mean"), field.get("o")) == (3.0, 3.0, "satisfied")
    told = field.quality("QR")
    assert (told.metric, told.satisfied, told.active) == (3.0, True, False)
    field.put("speed", 1.0)
    field.tick(1.0)
    assert (field.get("m"), field.get("o")) == (1.0, "violated")


def test_a_last_metric_goes_before_the_measure_of_a_run_of_one_tick() -> None:
    field = Field(task("<Spelt script='S'/>", value="5", measure="integral", metric="{m}"))
    field.tick()
    assert field.get("m") == 0.0


def test_a_run_of_one_tick_without_data_is_unknown() -> None:
    field = Field(task("<Spelt script='S'/>", value="{speed}", metric="{m}", out_status="{o}"))
    assert field.tick() == "S"
    assert (field.get("m"), field.get("o")) == (None, "unknown")
