"""Plans as small Python classes, and FROG's own."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

from behavior_tree import Input, LoadError, NodeError, load_text
from regraft import CallFailed
from regraft.bus_schema.model.adaptation import ChangeState, Connect, Outcome, SetParameters
from regraft.bus_schema.model.lifecycle import Transition
from regraft.bus_schema.model.robots.scoped_changes import Names
from regraft.services.bt_executor.adaptation import AdaptOnStart, AdaptOnSuccess, Change, Impossible, Result
from regraft.services.bt_executor.node_types import NODE_TYPES, node_types
from regraft.stacks.frog.plans import PLANS
from tests.adapting.helpers import Bench, FakeContext, bench, speed_change
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "adapting.md"


class Ladder(AdaptOnStart):
    """Climbs one rung with each start, and remembers on which it stands."""

    rungs = Input[Any](default="0.1;0.18;0.26")

    def __init__(self, setup: Any, context: Any) -> None:
        super().__init__(setup, context)
        self.rung = 0

    def plan(self) -> Change:
        return SetParameters("navigator", {"max_velocity": (0.1, 0.18, 0.25)[self.rung]})

    def adapted(self, result: Result) -> None:
        self.rung += 1


@pytest.mark.parametrize(
    "fate", [Outcome.REJECTED, Outcome.ROLLED_BACK, Outcome.STUCK, CallFailed("s", None, "silence")]
)
def test_a_plan_moves_on_only_when_it_was_applied(fate: Outcome | CallFailed) -> None:
    at = bench("Ladder", "", "SUCCESS", classes=(Ladder,), context=FakeContext(fates=[fate]))
    at.ticks(3)
    speeds = [wanted["max_velocity"] for wanted in at.context.asked_for]
    assert speeds == [0.1, 0.1, 0.18]
    assert at.node.rung == 2


def test_a_plan_that_is_halted_while_it_waits_has_not_moved_on() -> None:
    at = bench("Ladder", "", "SUCCESS", classes=(Ladder,), context=FakeContext(answers=False))
    at.tick()
    at.context.answer()
    at.tick()
    at.tree.halt_tree()
    at.context.answer()
    assert at.node.rung == 0


class Halver(AdaptOnSuccess):
    """Halves a speed, of which it wants to know what it is."""

    asked = 0

    def plan(self) -> Change | None:
        self.asked += 1
        speed = self.current("navigator", "max_velocity")
        return SetParameters("navigator", {"max_velocity": speed / 2}) if speed > 0.1 else None


def test_a_plan_may_ask_what_is_so_and_is_told_the_truth() -> None:
    at = bench("Halver", "", "SUCCESS", classes=(Halver,))
    at.tick(0.1)
    at.context.change(speed_change(0.24))
    at.tick(0.1)
    at.tick(0.1)
    assert [wanted["max_velocity"] for wanted in at.context.asked_for] == [0.13, 0.12, 0.06]
    assert at.tick(0.1) == "SUCCESS"
    assert len(at.context.adaptations) == 3


class Misled(AdaptOnStart):
    """Asks for something that there is not."""

    def plan(self) -> Change:
        raise Impossible(str(self.current("navigator", "colour")))


def test_asking_for_what_is_not_there_is_told() -> None:
    at = bench("Misled", 'outcome="{o}" reason="{r}"', "SUCCESS", classes=(Misled,))
    assert at.tick() == "SUCCESS"
    assert at.entry("o") == "rejected"
    assert "no parameter 'colour'" in at.entry("r")


class Broken(AdaptOnStart):
    """Has a slip."""

    level = Input(float)

    def plan(self) -> None:
        if self.level > 0:
            raise ZeroDivisionError("oh")


def test_a_plan_without_its_data_decides_nothing_but_one_with_a_slip_fails_with_its_name() -> None:
    at = bench("Broken", 'level="{level}"', "SUCCESS", classes=(Broken,))
    assert at.tick() == "SUCCESS"
    at.set(level="1")
    with pytest.raises(NodeError, match=r"'adapt'.*oh"):
        at.tick()
    at.tree.halt_tree()
    assert at.idle


def test_a_class_with_a_plan_takes_no_rules() -> None:
    with pytest.raises(LoadError, match="has a plan of its own; it takes no port rules"):
        bench("Ladder", 'rules="navigator.max_velocity := 1"', classes=(Ladder,))


def test_all_variants_are_known_to_the_executor() -> None:
    moments = ("OnStart", "OnRunning", "OnSuccess", "OnFailure", "OnAnyStatus", "Periodically")
    assert {f"Adapt{moment}" for moment in moments} <= NODE_TYPES.keys()


@pytest.mark.parametrize("xml", re.findall(r"```xml\n(.*?)```", PAGE.read_text(), re.DOTALL))
def test_the_trees_of_the_page_load(xml: str) -> None:
    known = node_types(FakeContext())  # type: ignore[arg-type]
    load_text(f'<root BTCPP_format="4"><BehaviorTree ID="Main">{xml}</BehaviorTree></root>', known)


# --- FROG ---


def speeds(at: Bench, **measures: float) -> list[float]:
    """Let FROG measure something for three seconds; returns the speeds that it has asked for altogether."""
    at.set(**measures)
    at.ticks(30)
    return [wanted["max_velocity"] for wanted in at.context.asked_for]


def test_frog_slows_down_near_obstacles_and_speeds_up_when_it_is_far_from_them() -> None:
    at = bench("AdjustMaxVelocity", 'safety="{safety}" leg_energy="{energy}"', classes=tuple(PLANS))
    at.tick()
    assert speeds(at) == [], "without data nothing is decided"
    assert speeds(at, safety=0.12, energy=79.0) == []
    assert speeds(at, safety=0.09) == [0.18]
    assert speeds(at, safety=0.16) == [0.18, 0.26]
    assert speeds(at, energy=81.0) == [0.18, 0.26, 0.18]
    assert speeds(at) == [0.18, 0.26, 0.18, 0.1]
    assert speeds(at) == [0.18, 0.26, 0.18, 0.1], "it is as slow as it may be"
    assert speeds(at, safety=0.12, energy=77.0)[-1] == 0.18


@pytest.mark.parametrize(
    ("left", "darkness", "looks", "camera", "pictures"),
    [
        (7113.0, 0.2, 20, "camera/image", 1),
        (7113.0, 0.8, 20, "camera/image", 3),
        (1304.1, 0.8, 20, "camera/image", 3),
        (1304.0, 0.8, 20, "corner_camera/image", 1),
        (1304.0, 0.7, 20, "camera/image", 1),
        (119.0, 0.8, 0, "camera/image", 3),
        (118.0, 0.8, 0, "corner_camera/image", 1),
        (0.0, 0.2, 20, "corner_camera/image", 1),
        (-5.0, 0.8, 20, "corner_camera/image", 1),
    ],
)
def test_how_frog_looks(left: float, darkness: float, looks: int, camera: str, pictures: int) -> None:
    ports = 'energy_left="{left}" darkness="{darkness}" looks_left="{looks}"'
    at = bench(
        "AdjustDetectionAttempts", ports, "SUCCESS", classes=tuple(PLANS), left=left, darkness=darkness, looks=looks
    )
    at.context.change(SetParameters("detector", {"pictures": 2}))
    at.tick()
    (request,) = at.context.adaptations
    assert at.context.asked_for == [{"pictures": pictures}]
    moved = [change for change in request.changes if isinstance(change, Connect)]
    assert moved == ([] if camera == "camera/image" else [Connect("detector", "image", camera)])


def test_a_plan_of_one_robot_among_several_names_its_own_components() -> None:
    context = FakeContext(names=Names("left"))
    known = context.architecture.components
    own = {f"left.{name}": replace(spec, name=f"left.{name}") for name, spec in known.items()}
    context.architecture = replace(context.architecture, components=known | own)
    bench("Halver", "", "SUCCESS", classes=(Halver,), context=context).ticks(2)
    rules = "connect detector.image to front, connect /detector.image to /corner, activate /lamp, mode := 'bold'"
    bench("AdaptOnStart", f'rules="{rules}" subject_location="navigator"', context=context).tick()
    asked = [change for request in context.adaptations for change in request.changes]
    assert asked[0] == SetParameters("left.navigator", {"max_velocity": 0.13})
    assert asked[-4:] == [
        Connect("left.detector", "image", "left/front"),
        Connect("detector", "image", "corner"),
        ChangeState("lamp", Transition.ACTIVATE),
        SetParameters("left.navigator", {"mode": "bold"}),
    ]
