"""Two robots of a kind in one system, each under a metacontroller of its own: neither touches the other."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from regraft.bus_schema.messages.management.objectives import (
    Objective,
    ObjectivesQuery,
    ObjectivesRequest,
    ObjectivesStatus,
    ObjectiveStatus,
)
from regraft.bus_schema.model.lifecycle import State
from tests.cli.live import regraft
from tests.executor.helpers import tree
from tests.metacontrol.patrol.parts import Condition
from tests.metacontrol.robots.stacks import write
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

PARTS = ("controller", "laser", "camera")
OBJECTIVE = Objective("to_navigate", "carry", {"safety": 0.5})


TREE = '<Objective name="carry" skill="to_navigate" requirements="safety: 0.5"><Sleep msec="3600000"/></Objective>'


class Robots(System):
    """Both robots, running in a home of their own."""

    def __init__(self, folder: Path) -> None:
        super().__init__(write(folder))
        self.home = folder / "home"

    def command(self, *arguments: str) -> str:
        """Return what a command prints that succeeds."""
        done = regraft(self.home, *arguments)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def objectives(self, robot: str) -> list[ObjectiveStatus]:
        """Return a robot's objectives."""
        place = f"{robot}/planners/metacontrol/objectives/list"
        return list(self.client.call(place, ObjectivesQuery(), ObjectivesStatus, PATIENCE).objectives)

    def active(self, robot: str) -> set[str]:
        """Return which of a robot's parts really are active."""
        return {name for name in PARTS if self.client.view(f"{robot}.{name}").state is State.ACTIVE}

    def put(self, robot: str, part: str, *, well: bool) -> None:
        """Mend a part of a robot, or break it."""
        self.client.call(f"{robot}/workshop/set", Condition(f"{robot}.{part}", well), Condition, PATIENCE)


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robots]:
    """Run both robots."""
    folder = tmp_path_factory.mktemp("robots")
    with home(folder / "home"), all_ended() as started:
        robots = Robots(folder)
        started.append(robots)
        yield robots


@pytest.fixture
def robots(running: Robots) -> Iterator[Robots]:
    """Return the robots, whole and without objectives before and after."""
    yield running
    for robot in ("north", "south"):
        running.put(robot, "laser", well=True)
        for each in running.objectives(robot):
            running.command("objective", "cancel", each.objective, "--robot", robot)


def test_each_robot_has_objectives_of_its_own_and_leaves_what_fails(robots: Robots) -> None:
    for robot in ("north", "south"):
        place = f"{robot}/planners/metacontrol/objectives/add"
        request = ObjectivesRequest((OBJECTIVE,), "tester")
        (added,) = robots.client.call(place, request, ObjectivesStatus, PATIENCE).objectives
        assert (added.realization, added.mode) == ("normal", f"{robot}/to_navigate.normal")
    robots.put("north", "laser", well=False)
    wait_until(lambda: robots.objectives("north")[0].realization == "degraded", "north without its laser")
    wait_until(lambda: robots.active("north") == {"controller", "camera"}, "what north needs then")
    assert robots.objectives("south")[0].realization == "normal"
    assert robots.active("south") == {"controller", "laser"}
    robots.put("north", "laser", well=True)
    wait_until(lambda: robots.objectives("north")[0].realization == "normal", "north with its laser again")


def test_commands_name_the_robot(robots: Robots) -> None:
    unnamed = regraft(robots.home, "objective", "add", "to_navigate")
    assert unnamed.returncode == 2
    assert "north.metacontrol, south.metacontrol" in unnamed.stderr
    assert "to_navigate.normal" in robots.command("objective", "add", "to_navigate", "--robot", "south")
    assert robots.objectives("north") == []
    assert robots.active("north") == set()


def test_a_tree_asks_the_metacontroller_of_its_robot(robots: Robots, tmp_path: Path) -> None:
    mission = tmp_path / "mission.xml"
    mission.write_text(tree(TREE))
    robots.command("mission", "load", str(mission), "--robot", "south")
    robots.command("mission", "start", "--robot", "south")
    wait_until(lambda: robots.active("south") == {"controller", "laser"}, "what the mission needs")
    assert robots.objectives("north") == []
    robots.command("mission", "halt", "--robot", "south")
    wait_until(lambda: robots.active("south") == set(), "rest")
