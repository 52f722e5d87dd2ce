"""System-level requirements take in those of the tasks that are running."""

from __future__ import annotations

import pytest

from regraft.services.bt_executor.quality import SystemLevelQR
from tests.quality.helpers import Field, system, task

RUNS = "<Spelt/>"


def both(first: str, second: str) -> str:
    """Return two branches side by side."""
    return f"<ParallelAll>{first}{second}</ParallelAll>"


def test_it_takes_in_the_tasks_of_its_attribute_only() -> None:
    power = task(RUNS, "P1", value="2", quality_attribute="Power")
    safety = task(RUNS, "S1", value="50")
    other = task(RUNS, "P2", value="3", quality_attribute="Power")
    field = Field(system(both(power, both(safety, other)), quality_attribute="Power", combine="sum", at_most="5"))
    field.tick()
    assert (field.quality("SYS").metric, field.quality("SYS").satisfied) == (5.0, True)


@pytest.mark.parametrize(
    ("combine", "value"), [("sum", 9.0), ("mean", 3.0), ("min", 1.0), ("max", 6.0), ("weighted_mean", 23.0 / 6.0)]
)
def test_it_combines_metrics_and_its_own_value(combine: str, value: float) -> None:
    tasks = both(task(RUNS, "A", value="1", weight="2"), task(RUNS, "B", value="6", weight="3"))
    field = Field(system(tasks, combine=combine, value="2"))
    if combine == "weighted_mean":
        value = (2 * 1 + 3 * 6 + 1 * 2) / 6
    field.tick()
    assert field.quality("SYS").metric == pytest.approx(value)


def test_a_task_that_is_done_halted_or_skipped_is_not_taken_in() -> None:
    done = task("<Spelt script='RS'/>", "A", value="1")
    skipped = task("<Spelt script='K'/>", "B", value="10")
    stays = task(RUNS, "C", value="100")
    field = Field(system(both(done, both(skipped, stays)), combine="sum"))
    field.tick()
    assert field.quality("SYS").metric == 101.0
    field.tick()
    assert field.quality("SYS").metric == 100.0


def test_a_branch_that_is_left_is_not_taken_in_any_more() -> None:
    here, there = task(RUNS, "A", value="1"), task(RUNS, "B", value="10")
    choice = f'<Switch2 variable="{{which}}" case_1="a" case_2="b">{here}{there}{RUNS}</Switch2>'
    field = Field(system(choice, combine="sum", value="0.5"), board={"which": "a"})
    field.tick()
    assert field.quality("SYS").metric == 1.5
    field.put("which", "b")
    field.tick()
    assert field.quality("SYS").metric == 10.5
    assert [each.requirement for each in field.ear.book.current() if each.active] == ["SYS", "B"]
    field.put("which", "c")
    field.tick()
    assert field.quality("SYS").metric == 0.5


def test_tasks_of_one_type_and_one_name_in_sub_trees_are_kept_apart() -> None:
    sub = f'<BehaviorTree ID="Sub">{task(RUNS, "QR", value="{v}")}</BehaviorTree>'
    two = both('<SubTree ID="Sub" name="left" v="1"/>', '<SubTree ID="Sub" name="right" v="2"/>')
    field = Field(system(two, combine="sum"), others=sub)
    field.tick()
    assert field.quality("SYS").metric == 3.0
    qualities = {each.requirement: (each.node, each.metric) for each in field.ear.book.current()}
    assert qualities == {"SYS": ("SYS", 3.0), "left-QR": ("left/QR", 1.0), "right-QR": ("right/QR", 2.0)}


def test_siblings_of_one_name_are_kept_apart_too() -> None:
    field = Field(system(both(task(RUNS, "QR", value="1"), task(RUNS, "QR", value="2")), combine="sum"))
    field.tick()
    assert field.quality("SYS").metric == 3.0
    assert {each.requirement for each in field.ear.book.current()} == {"SYS", "QR", "QR-2"}


def test_a_system_level_requirement_below_is_not_counted_twice() -> None:
    inner = system(task(RUNS, "A", value="2"), "INNER", combine="sum")
    field = Field(system(inner, combine="sum"))
    field.tick()
    assert (field.quality("INNER").metric, field.quality("SYS").metric) == (2.0, 2.0)


def test_of_an_unknown_part_no_whole_is_known() -> None:
    tasks = both(task(RUNS, "A", value="1"), task(RUNS, "B", value="{@absent}"))
    field = Field(system(tasks, combine="sum"))
    field.tick()
    assert field.quality("SYS").metric is None
    assert field.quality("SYS").reason == "'B' is unknown: there are no data in '@absent'"


def test_nothing_to_combine_is_unknown() -> None:
    field = Field(system(RUNS, combine="mean"))
    field.tick()
    assert "no requirement is active below" in field.quality("SYS").reason


def test_weights_of_zero_are_unknown_and_no_error() -> None:
    field = Field(system(task(RUNS, "A", value="1", weight="0"), combine="weighted_mean"))
    assert field.tick() == "R"
    assert field.quality("SYS").reason == "all weights are 0"


def test_its_own_data_suffice() -> None:
    field = Field(system(RUNS, value="{@battery_charge}", at_least="0.9"), board={"battery_charge": 0.95})
    field.tick()
    assert (field.quality("SYS").satisfied, field.quality("SYS").level.value) == (True, "system")


class Worst(SystemLevelQR):
    """How far the worst of the tasks is satisfied."""

    attribute = "Safety"

    def measure(self) -> float | None:
        """Return the least degree."""
        return min(task.verdict.degree or 0.0 for task in self.gathered().values())

    def degree_of(self, metric: float) -> float:
        """Return the same."""
        return metric


def test_a_class_sees_the_tasks_by_their_paths() -> None:
    good = task(RUNS, "A", value="1", at_least="0", within="2")
    bad = task(RUNS, "B", value="1", at_least="2", within="2")
    field = Field(f'<Worst name="W">{both(good, bad)}</Worst>', Worst)
    field.tick()
    assert (field.quality("W").degree, field.quality("W").satisfied) == (0.25, False)
    (worst,) = [node for node in field.tree.nodes if isinstance(node, Worst)]
    assert list(worst.gathered()) == ["A", "B"]


@pytest.mark.parametrize(("combine", "metric"), [("sum", 0.0), ("mean", None), ("min", None), ("max", None)])
def test_the_sum_over_no_task_is_zero_and_other_combinations_are_unknown(combine: str, metric: float | None) -> None:
    done = task("<Spelt script='K'/>", "A", value="7")
    field = Field(system(both(done, RUNS), combine=combine, at_most="8", metric="{m}"))
    field.tick()
    assert field.get("m") == metric
    assert field.quality("SYS").satisfied is (True if metric == 0.0 else None)
