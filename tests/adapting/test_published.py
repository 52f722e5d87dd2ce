"""The architecture from its topic: nobody is asked when nothing is to be done, and reactive trees come to their end."""

from __future__ import annotations

from typing import Any

import pytest

from behavior_tree import RUNNING, SUCCESS, ManualClock, Tree, load_text
from regraft.bus_schema.messages.mission import Command, MissionState
from regraft.bus_schema.model.adaptation import Outcome
from regraft.services.bt_executor.adaptation import AdaptOnRunning, SetParameters
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.adapting.helpers import FakeContext, Scripted, bench, registry, small_architecture, speed_change
from tests.executor.helpers import command, status, tree

SPEED = 'subject_location="navigator" rules="max_velocity := 0.1" outcome="{o}"'
RESTARTED = ["AdaptOnStart", "AdaptOnSuccess", "AdaptOnAnyStatus"]


def reactive(node_type: str, context: FakeContext, ports: str = SPEED) -> tuple[Tree, Scripted]:
    xml = f"""<root BTCPP_format="4"><BehaviorTree ID="Main"><ReactiveSequence>
        <{node_type} name="adapt" {ports}><AlwaysSuccess/></{node_type}><Scripted name="work"/>
        </ReactiveSequence></BehaviorTree></root>"""
    loaded = load_text(xml, registry(context), clock=context.clock)
    work = loaded.node("work")
    assert isinstance(work, Scripted)
    work.statuses = [RUNNING] * 11 + [SUCCESS]
    return loaded, work


@pytest.mark.parametrize("node_type", RESTARTED)
def test_a_long_action_next_to_an_adapted_condition_comes_to_its_end(node_type: str) -> None:
    context = FakeContext(clock=ManualClock(), answers=False)
    context.publish()
    loaded, work = reactive(node_type, context)
    seen = []
    for _ in range(40):
        context.advance(0.5)
        seen.append(loaded.tick_once(20))
        context.answer()
        context.publish()
        if seen[-1] != RUNNING:
            break
    assert seen[-1] == SUCCESS
    assert (work.starts, work.halts) == (1, 0)
    assert context.asked_for == [{"max_velocity": 0.1}]


@pytest.mark.parametrize("node_type", [*RESTARTED, "AdaptOnRunning"])
def test_nobody_is_asked_when_all_is_as_it_should_be(node_type: str) -> None:
    at = bench(node_type, SPEED, "SUCCESS" if node_type != "AdaptOnRunning" else "RUNNING SUCCESS")
    at.context.change(speed_change(0.1))
    at.context.publish()
    assert at.end()[-1] == "SUCCESS"
    assert at.context.asked == []
    assert at.entry("o") == (None if node_type == "AdaptOnRunning" else "unchanged")


class Careful(AdaptOnRunning):
    """Slows down unless it is slow already."""

    def plan(self) -> SetParameters | None:
        return None if self.current("navigator", "max_velocity") <= 0.1 else speed_change(0.1)


def test_a_plan_reads_the_published_architecture_and_decides_again_before_it_changes_anything() -> None:
    at = bench("Careful", "", classes=(Careful,))
    at.context.change(speed_change(0.05))
    at.context.publish()
    at.ticks(30)
    assert at.context.asked == []
    at.context.change(speed_change(0.26))
    at.ticks(30)
    assert at.context.asked == []
    at.context.publish()
    at.tick(0.1)
    (request,) = at.context.adaptations
    assert request.revision == 3


def test_what_was_decided_on_an_old_architecture_is_rejected_by_its_revision_and_decided_again() -> None:
    at = bench("AdaptOnStart", 'subject_location="navigator" rules="max_velocity -= 0.1" outcome="{o}"')
    at.context.publish()
    at.context.answers = False
    at.tick()
    at.context.answer()
    at.tick()
    at.context.change(speed_change(0.2))
    at.context.answers = True
    at.context.answer()
    at.tick()
    assert [request.revision for request in at.context.adaptations] == [1, 2]
    assert at.context.asked_for[-1] == {"max_velocity": 0.1}
    assert at.entry("o") == "applied"


def test_a_topic_that_is_behind_the_last_answer_decides_nothing() -> None:
    at = bench("AdaptOnRunning", SPEED, context=FakeContext(fates=[Outcome.APPLIED]))
    at.context.publish()
    at.tick()
    at.context.change(speed_change(0.26))
    at.context.know_revision(at.context.architecture.revision)
    at.context.change(speed_change(0.1))
    at.ticks(20)
    assert at.context.asked_for == [{"max_velocity": 0.1}]


def test_an_executor_without_a_manager_goes_through_a_reactive_tree_by_the_topic_alone() -> None:
    adapted = f"<AdaptOnStart {SPEED.replace('0.1', '0.26')}><AlwaysSuccess/></AdaptOnStart>"
    with Rig() as rig:
        rig.add(Executor, "bt_executor", {"autostart": False})
        rig.publish("architecture", small_architecture())
        command(rig, Command.LOAD, tree(f'<ReactiveSequence>{adapted}<Sleep msec="2500"/></ReactiveSequence>'))
        command(rig, Command.START)
        rig.advance(3.0)
        ended = status(rig)
        outcome: Any = ended.blackboard["o"]
        assert (ended.state, outcome) == (MissionState.SUCCEEDED, "unchanged")
