"""Each tree of FROG's missions does what it is for, and fails where that cannot be done, if it is one that may fail."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from regraft.bus_schema.messages.mission import Command, MissionState
from regraft.bus_schema.model.adaptation import Outcome
from regraft.services.bt_executor.executor import Executor
from regraft.testing import Rig
from tests.executor.helpers import command, kinds, status
from tests.executor.robot import goals
from tests.missions.acting import ActingManager, Senses
from tests.missions.robot import (
    MISSIONS,
    NODES,
    STACKS,
    Detector,
    Docking,
    Explorer,
    Mapper,
    Navigator,
    darkness,
    power,
    sensors,
)

pytestmark = pytest.mark.slow

NEVER_SUCCEED = {"Rounds", "Frog", "Inspection"}
"""They go on for ever."""
NEVER_FAIL = {"LookAgain", "WaitForLight", "LookForHydrant", "Frog", "Inspection"}
"""A look that cannot be made is left out. Some wait as long as it takes, for goals or for a metacontroller."""


class Crew:
    """All parts of the robot; they do as they are told."""

    def __init__(self, rig: Rig, stack: str) -> None:
        self.rig = rig
        self.navigator = rig.add(Navigator)
        self.explorer = rig.add(Explorer, parameters={"count": 1})
        self.docking = rig.add(Docking)
        self.detector = rig.add(Detector)
        self.detector.navigator = self.navigator
        self.detector.seen_from = {0.0}
        self.manager = rig.add(ActingManager, "adaptation_manager")
        self.manager.manage(rig, stack)
        self.senses = rig.add(Senses, "system_reflection")
        self.mapper = rig.add(Mapper)
        self.goals: tuple[str, ...] = ("a", "b")
        self.charge = 1.0
        self.darkness = 0.0
        self.faults: tuple[str, ...] = ()

    def tell(self) -> None:
        """Tell what is so in the world."""
        power(self.rig, self.charge)
        darkness(self.rig, self.darkness)
        sensors(self.rig, *self.faults)
        if self.goals:
            self.rig.publish("goals", goals(*self.goals))


def well(crew: Crew) -> None:
    """Leave all as it is."""


def blocked(crew: Crew) -> None:
    crew.navigator.blocked = {0.0, 1.0}


def no_goals(crew: Crew) -> None:
    crew.goals = ()


def no_pictures(crew: Crew) -> None:
    crew.detector.failures = 1000


def no_charger(crew: Crew) -> None:
    crew.docking.failures = 1000


def no_frontier(crew: Crew) -> None:
    crew.explorer.failures = 1000


def faulty(crew: Crew) -> None:
    crew.faults = ("scan silent",)


def faulty_and_blocked(crew: Crew) -> None:
    faulty(crew)
    blocked(crew)


def refused(crew: Crew) -> None:
    crew.manager.fates = [Outcome.REJECTED] * 100


def explored(crew: Crew) -> None:
    crew.rig.runtimes["explorer"].parameters.set({"count": 0})


@dataclass(frozen=True)
class Tree:
    """A tree, what is on the root blackboard first, and how it comes to succeed and to fail; None: it never does."""

    file: str
    name: str
    succeeds: Callable[[Crew], None] | None
    fails: Callable[[Crew], None] | None
    script: str = ""

    def __str__(self) -> str:
        return f"{self.file}-{self.name}"


VISITING = (
    "@visits := 0; @rounds := 1; @located := false; @on_the_way := false; @wait_for_light := false; "
    "@sensor_faults := ''; @problems := ''; @darkness := 0.0"
)
ENOUGH = VISITING.replace("@visits := 0", "@visits := 60")
CHARGING = "@to_charge := true; @charges := 0; @sensor_faults := ''; @problems := ''; @battery_charge := 0.5"
ROUNDS = "@looks_left := 10"
COMMON = ("planned", "internal_common", "external_common", "rules")
MEASURED = "@energy_left := 7000.0; @corner_faults := 0; @darkness := 0.5"
LOOKING = "entries := 'darkness'; options := 'camera/image | 1 | 1.0'"

TREES = [
    Tree("rounds_baseline", "Rounds", None, no_goals),
    Tree("rounds_baseline", "OneRound", well, no_goals),
    # A goal that cannot be reached, and a look that cannot be taken, are told and left out.
    *(Tree(f"rounds_{kind}", "Visit", well, None) for kind in ("baseline", "internal", "external")),
    *(Tree(f"rounds_{kind}", "LookAgain", well, None, ROUNDS) for kind in ("baseline", "internal", "rewired")),
    *(Tree(f"rounds_{kind}", "Drive", well, blocked) for kind in ("baseline", "internal", "external")),
    *(Tree(f"rounds_{kind}", "AdaptedDrive", well, blocked) for kind in ("baseline", "internal", "external")),
    *(Tree(f"rounds_{kind}", "Look", well, no_pictures, ROUNDS) for kind in ("baseline", "internal", "rewired")),
    *(Tree(f"rounds_{kind}", "AdaptedLook", well, no_pictures, ROUNDS) for kind in ("baseline", "internal", "rewired")),
    *(Tree(f"rounds_{kind}", "OneRound", well, no_goals) for kind in ("internal", "external", "rewired")),
    *(Tree(f"rounds_{kind}", "Rounds", None, no_goals) for kind in ("internal", "external", "rewired")),
    *(Tree(f"rounds_{kind}", "AdaptedDrive", well, blocked) for kind in COMMON),
    *(Tree(f"rounds_{kind}", "AdaptedLook", well, no_pictures, f"{ROUNDS}; {MEASURED}") for kind in COMMON),
    Tree("rounds_planned", "ForecastDrive", well, blocked, "period := '250ms'; speeds := '0.10;0.17'"),
    Tree("rounds_planned", "ForecastLook", well, no_pictures, f"{ROUNDS}; {LOOKING}"),
    Tree("rounds_baseline", "DriveTo", well, blocked),
    Tree("rounds_baseline", "LookAt", well, no_pictures),
    Tree("explore", "Explore", well, no_charger, "@battery_charge := 1.0"),
    Tree("explore", "LookFurther", well, explored, "@unreached := false; @sensor_faults := ''; @problems := ''"),
    Tree("explore", "ChargeUp", well, no_charger, CHARGING),
    Tree("explore", "WaitForSensors", well, faulty, "@problems := ''"),
    Tree("visit", "Visit", well, no_goals),
    Tree("visit", "VisitNext", well, None, VISITING),
    Tree("visit", "VisitNext", None, well, ENOUGH),
    Tree("visit", "Choose", well, None, VISITING),
    Tree("visit", "Choose", None, well, ENOUGH),
    Tree("visit", "WaitForLight", well, None, VISITING),
    Tree("visit", "LookForHydrant", well, None, VISITING),
    Tree("visit", "Look", well, no_pictures),
    Tree("visit", "LookAt", well, no_pictures, "@located := false"),
    Tree("visit", "Drive", well, blocked),
    Tree("visit", "DriveTo", well, blocked),
    Tree("search", "Search", well, no_charger),
    Tree("search", "FromExploringToVisiting", well, refused),
    Tree("search_external", "Search", well, refused),
]


def files() -> list[Path]:
    """Return the files of all missions and plans, but for Nav2's trees and their rounds: ``tests/nav2`` drives them."""
    found = [file for file in sorted(MISSIONS.rglob("*.xml")) if "nav2" not in (file.stem, file.parent.name)]
    return [STACKS / "mission.xml", *found]


def test_every_tree_is_driven_to_success_and_to_failure() -> None:
    trees = {tree.attrib["ID"] for file in files() for tree in ElementTree.parse(file).iter("BehaviorTree")}
    assert {tree.name for tree in TREES if tree.succeeds} == trees - NEVER_SUCCEED
    assert {tree.name for tree in TREES if tree.fails} == trees - NEVER_FAIL


def driven(tree: Tree, prepare: Callable[[Crew], None], seconds: float) -> tuple[MissionState, list[str]]:
    """Drive a tree, with a goal to go to, to its end; returns how it ended, and what was told."""
    subtree = f'<SubTree ID="{tree.name}" _autoremap="true" goal="{{goal}}" goal_name="{{goal_name}}"/>'
    take = "" if prepare is no_goals or tree.file == "explore" else (
        '<GetGoals goals="{@goals}"/><NextGoal goals="{@goals}" index="{index}" goal="{goal}" goal_name="{goal_name}"/>'
    )  # fmt: skip
    script = f'<Script code="{tree.script}"/>' if tree.script else ""
    text = (
        f'<root BTCPP_format="4" main_tree_to_execute="Case"><include path="{tree.file}.xml"/>'
        f'<BehaviorTree ID="Case"><Sequence>{script}{take}{subtree}</Sequence></BehaviorTree></root>'
    )
    stack = tree.file.partition("_")[0]
    with Rig() as rig:
        crew = Crew(rig, {"visit": "search"}.get(stack, stack))
        prepare(crew)
        given = {"mission": str(MISSIONS / f"{tree.file}.xml"), "nodes": NODES, "autostart": False}
        rig.add(Executor, "bt_executor", given)
        command(rig, Command.LOAD, text)
        crew.tell()
        command(rig, Command.START)
        for _ in range(round(seconds / 5.0)):
            rig.advance(5.0)
            if status(rig).state is not MissionState.RUNNING:
                break
        return status(rig).state, kinds(rig)


@pytest.mark.parametrize("tree", [tree for tree in TREES if tree.succeeds], ids=str)
def test_a_tree_succeeds_where_all_is_well(tree: Tree) -> None:
    assert tree.succeeds is not None
    assert driven(tree, tree.succeeds, 200.0)[0] is MissionState.SUCCEEDED


@pytest.mark.parametrize("prepare", [blocked, no_pictures], ids=lambda prepare: prepare.__name__)
@pytest.mark.parametrize("mission", ["rounds_baseline", "rounds_internal", "rounds_external", "rounds_rewired"])
def test_what_cannot_be_done_is_left_out_of_a_round(mission: str, prepare: Callable[[Crew], None]) -> None:
    state, told = driven(Tree(mission, "OneRound", prepare, None), prepare, 400.0)
    assert state is MissionState.SUCCEEDED
    assert ("mission.goal_missed" if prepare is blocked else "mission.trouble") in told


@pytest.mark.parametrize("tree", [tree for tree in TREES if tree.fails], ids=str)
def test_a_tree_fails_where_its_task_cannot_be_done(tree: Tree) -> None:
    assert tree.fails is not None
    state, told = driven(tree, tree.fails, 400.0)
    assert state is MissionState.FAILED
    if tree.name in {
        "Rounds",
        "OneRound",
        "ChargeUp",
        "Explore",
        "Search",
        "WaitForSensors",
        "FromExploringToVisiting",
    }:
        assert "mission.trouble" in told
