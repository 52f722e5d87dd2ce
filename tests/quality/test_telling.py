"""What goes out to the bus, and what the executor keeps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.mission import Command, MissionState
from regraft.bus_schema.messages.quality import Quality, QualityLevel
from regraft.bus_schema.model.lifecycle import State
from regraft.services.bt_executor.executor import Executor
from regraft.services.bt_executor.quality import QualityPublisher
from regraft.testing import Rig
from tests.executor.helpers import command, run, status, tree
from tests.quality.helpers import Field, task
from tests.stepped.parts import TinyWorld
from tests.support.stepped.step_site import StepSite

FIRST = Quality(0.0, "QR", "Safety", metric=1.0, satisfied=True, degree=1.0, status="satisfied")


def announced(*qualities: Quality) -> list[Quality]:
    """Return what goes out of what is told."""
    out: list[Quality] = []
    announcer = QualityPublisher(out.append)
    for quality in qualities:
        announcer.tell(quality)
    return out


def test_nothing_goes_out_while_nothing_changes() -> None:
    same = [replace(FIRST, stamp=0.1 * number, metric=1.0 + 1e-6 * number, mean=0.1 * number) for number in range(100)]
    assert announced(*same) == [same[0]]


def test_what_decides_goes_out_at_once() -> None:
    changes = [
        FIRST,
        replace(FIRST, satisfied=False),
        replace(FIRST, metric=None, satisfied=None),
        FIRST,
        replace(FIRST, active=False),
    ]
    assert announced(*changes) == changes


def test_numbers_and_words_go_out_at_most_five_times_a_second() -> None:
    told = [replace(FIRST, stamp=number / 20, metric=float(number), status=f"at {number}") for number in range(41)]
    assert [quality.metric for quality in announced(*told)] == [4.0 * number for number in range(11)]


def test_the_last_metric_of_a_run_goes_out_however_soon_it_comes() -> None:
    last = replace(FIRST, stamp=0.01, metric=2.0, active=False)
    assert announced(FIRST, last, replace(last, stamp=0.02)) == [FIRST, last]


def test_a_requirement_that_has_not_been_active_is_not_told() -> None:
    assert announced(replace(FIRST, active=False)) == []


def test_requirements_of_different_names_are_kept_apart() -> None:
    assert len(announced(FIRST, replace(FIRST, requirement="other"), FIRST)) == 2


def test_the_book_has_the_latest_of_each_in_the_order_of_the_tree() -> None:
    inner = task(name="B", value="{@b}")
    field = Field(task(inner, name="A", value="1"), board={"b": 1.0})
    field.tick()
    field.put("b", 2.0)
    field.tick()
    assert [(each.requirement, each.metric) for each in field.ear.book.current()] == [("A", 1.0), ("B", 2.0)]
    field.tree.halt_tree()
    assert [each.active for each in field.ear.book.current()] == [False, False]
    field.ear.book.follow(field.tree)
    assert field.ear.book.current() == ()


# --- with the executor ---

MISSION = tree(
    """<TaskLevelQR name="Move Safely!" quality_attribute="Safety" value="{@nearest}" at_least="0.5" weight="2"
                    metric="{@safety}" out_status="{@how_safe}"><Sleep msec="2000"/></TaskLevelQR>""",
    '<Sleep msec="1000"/>',
)


def told_on(rig: Rig) -> list[Quality]:
    """Return a list to which every quality on the bus is added from now on."""
    heard: list[Quality] = []
    rig.bus.subscribe(rig.keys.quality("*"), lambda sample: heard.append(codec.decode(sample.payload, Quality)))
    return heard


def board(executor: Executor, **values: object) -> None:
    """Write the root blackboard of the executor's mission."""
    mission = executor._mission.tree
    assert mission is not None
    for key, value in values.items():
        mission.blackboard.set(key, value)


def test_the_executor_puts_changes_at_the_requirements_key_and_keeps_the_latest() -> None:
    with Rig() as rig:
        keys: list[str] = []
        rig.bus.subscribe(rig.keys.quality("*"), lambda sample: keys.append(sample.key))
        heard = told_on(rig)
        executor = run(rig, MISSION)
        rig.advance(0.5)
        assert [(quality.satisfied, quality.reason) for quality in heard] == [(None, "there are no data in '@nearest'")]
        board(executor, nearest=1.0)
        rig.advance(0.5)
        board(executor, nearest=0.25)
        rig.advance(0.5)
        rig.advance(2.0)
        assert status(rig).state is MissionState.SUCCEEDED
        assert [(quality.metric, quality.satisfied, quality.active) for quality in heard[1:]] == [
            (1.0, True, True),
            (0.25, False, True),
            (0.25, False, False),
        ]
        assert set(keys) == {"rig/quality/Move_Safely_"}
        told = heard[1]
        assert (told.requirement, told.node, told.level, told.weight) == (
            "Move_Safely_",
            "Move Safely!",
            QualityLevel.TASK,
            2.0,
        )
        assert executor._qualities.current() == (heard[-1],)
        assert status(rig).blackboard["how_safe"] == "violated"


def test_another_tree_leaves_nothing_active_behind() -> None:
    with Rig() as rig:
        heard = told_on(rig)
        executor = run(rig, MISSION)
        rig.advance(0.5)
        command(rig, Command.LOAD, tree('<Sleep msec="1000"/>'))
        assert executor._qualities.current() == ()
        assert [quality.active for quality in heard] == [True, False]


def test_a_broken_measure_does_not_end_the_mission() -> None:
    with Rig() as rig:
        heard = told_on(rig)
        executor = run(rig, MISSION)
        board(executor, nearest="not a number")
        rig.advance(4.0)
        assert status(rig).state is MissionState.SUCCEEDED
        assert (heard[-1].status, heard[-1].reason) == ("unknown", "'not a number' is not a number")


CHANGING = tree(
    '<Script code="@n := 0.0"/>',
    """<ParallelAll>
         <Repeat num_cycles="30"><Sequence><Sleep msec="130"/><Script code="@n += 0.1"/></Sequence></Repeat>
         <SystemLevelQR name="all" quality_attribute="Power" combine="sum" value="{@n}">
           <TaskLevelQR name="one" quality_attribute="Power" value="{@n}" at_most="2"><Sleep msec="5000"/></TaskLevelQR>
         </SystemLevelQR>
       </ParallelAll>""",
)


def run_in_step(mission: Path) -> list[Quality]:
    """Run a mission for 8 s of simulated time; returns what was told."""
    heard: list[Quality] = []
    steps = StepSite("memory")
    try:
        steps.listen("steps/quality/*", lambda sample: heard.append(codec.decode(sample.payload, Quality)))
        steps.start(Executor, "bt_executor", parameters={"mission": str(mission)}, state=State.ACTIVE)
        steps.start_world(TinyWorld, ("bt_executor",), 8.0)
        assert steps.wait_finished().reproducible
        return heard
    finally:
        steps.close()


def test_equal_runs_in_step_tell_the_same(tmp_path: Path) -> None:
    mission = tmp_path / "mission.xml"
    mission.write_text(CHANGING)
    first = run_in_step(mission)
    assert {quality.requirement for quality in first} == {"one", "all"}
    assert len(first) > 20
    assert first == run_in_step(mission)
