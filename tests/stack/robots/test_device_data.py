"""Parameters of a robot's devices are what parameters of components are: paths, limits, data of the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from regraft.component.component import parameter_set
from regraft.sim_service.devices.core.fitting import fitted
from regraft.sim_service.simulation import own_parameters
from regraft.sim_service.world import World
from regraft.stack import Stack, StackError, check_with_classes, load
from tests.support.worlds import WAFFLE

STACK = """\
system: loud
clock: simulated
world: room.xml
robots:
  left: {robot: rover, parameters: {radius: 0.25}}
topics:
  world_state: {type: regraft/WorldState, rate: 20}
components:
  world:
    class: "regraft.sim_service.world:World"
    parameters: {file: $world, robots: $robots}
"""
ROBOT = """\
model: rover.xml
parameters: {radius: 0.22}
topics: {ground_truth: regraft/GroundTruth}
devices:
  player: {class: "MODULE:Player", parameters: {sound: sounds/honk.wav, far: 0.5}}
"""
PLAYER = """\
from regraft import Parameter
from regraft.sim_service.devices.core.device import Device


class Player(Device):
    sound = Parameter("", "what is played", unit="path", exists=True, read_only=True)
    reach = Parameter(1.0, "how far it can be heard", read_only=True)
    far = Parameter(1.0, "how far it is to be heard", limit="reach")
    radius = Parameter(0.3, "of the robot", from_robot="radius", read_only=True)
"""
ROOM = '<mujoco><worldbody><geom name="floor" type="plane" size="5 5 .1"/></worldbody></mujoco>'
DEVICE = "components.world.parameters.robots.0.devices.0"


def loaded(folder: Path, stack: str = STACK, robot: str = ROBOT, player: str = PLAYER) -> Stack:
    """Return a stack with a robot that has a player, checked with its classes."""
    module = f"{folder.parent.name}_{folder.name}_player".replace("-", "_")
    rover = folder / "rover"
    (rover / "sounds").mkdir(parents=True)
    for name in (folder / "mine.wav", rover / "sounds" / "honk.wav"):
        name.touch()
    (folder / "room.xml").write_text(ROOM)
    (folder / "stack.yaml").write_text(stack)
    (rover / "robot.yaml").write_text(robot.replace("MODULE", module))
    (rover / "rover.xml").write_text(WAFFLE.read_text())
    (rover / f"{module}.py").write_text(player)
    found = load(folder / "stack.yaml")
    check_with_classes(found)
    return found


def refusal(folder: Path, **files: str) -> str:
    """Return what is wrong with a stack."""
    with pytest.raises(StackError) as refused:
        loaded(folder, **files)
    return str(refused.value).replace(f"{folder}/", "")


def values(stack: Stack) -> dict[str, Any]:
    """Return the parameters of the player, by the world's names."""
    return parameter_set(World, stack.architecture.components["world"].parameters).values


def with_world(*given: str) -> str:
    """Return the stack with further parameters of the world."""
    return STACK.replace("robots: $robots}", ", ".join(("robots: $robots", *given)) + "}")


def test_a_path_is_looked_for_from_the_folder_of_the_file_that_has_it(tmp_path: Path) -> None:
    assert values(loaded(tmp_path / "own"))["left/player_sound"] == str(tmp_path / "own/rover/sounds/honk.wav")
    use = STACK.replace("0.25}", "0.25}, devices: {player: {parameters: {sound: mine.wav}}}")
    assert values(loaded(tmp_path / "used", use))["left/player_sound"] == str(tmp_path / "used" / "mine.wav")


def test_a_missing_file_is_refused_where_the_robots_file_names_it(tmp_path: Path) -> None:
    told = refusal(tmp_path, robot=ROBOT.replace("honk.wav", "hnk.wav"))
    assert told.startswith(
        f"rover/robot.yaml:5: {DEVICE}.parameters.sound: 'rover/sounds/hnk.wav': there is no such file"
    )


def test_a_robot_gives_its_devices_its_data_and_what_the_robots_file_sets_stays(tmp_path: Path) -> None:
    assert values(loaded(tmp_path / "given"))["left/player_radius"] == 0.25
    own = ROBOT.replace("far: 0.5", "radius: 0.4")
    assert values(loaded(tmp_path / "own", robot=own))["left/player_radius"] == 0.4


def test_a_robot_that_lacks_what_a_device_takes_is_refused_unless_the_stack_sets_it(tmp_path: Path) -> None:
    robot, use = ROBOT.replace("{radius:", "{radus:"), STACK.replace(", parameters: {radius: 0.25}", "")
    told = refusal(tmp_path / "lacking", stack=use, robot=robot)
    lacks = "comes from the robot, which has no parameter 'radius': add it to robots.left.parameters"
    assert told.startswith(f"rover/robot.yaml:1: {DEVICE}.parameters.radius: {lacks}")
    whole = use.replace("robots: $robots}", "robots: $robots, left/player_radius: 0.5}")
    assert values(loaded(tmp_path / "set", whole, robot))["left/player_radius"] == 0.5


def test_a_limit_holds_in_the_robots_file_and_keeps_the_default(tmp_path: Path) -> None:
    told = refusal(tmp_path / "beyond", robot=ROBOT.replace("far: 0.5", "far: 1.5"))
    assert told == f"rover/robot.yaml:5: {DEVICE}.parameters.far: 1.5: must be at most 1.0"
    near = loaded(tmp_path / "near", robot=ROBOT.replace("far: 0.5", "reach: 0.2"))
    assert values(near)["left/player_far"] == 0.2
    (device,) = fitted(World.robots.checked(near.architecture.components["world"].parameters["robots"]))
    assert own_parameters(device).values["far"] == 0.2


def test_a_limit_is_the_one_that_the_stack_sets(tmp_path: Path) -> None:
    found = loaded(tmp_path / "wide", with_world("left/player_reach: 6.0", "left/player_far: 5.0"))
    assert values(found)["left/player_far"] == 5.0
    told = refusal(tmp_path / "beyond", stack=with_world("left/player_reach: 4.0", "left/player_far: 5.0"))
    assert told.endswith("left/player_far: 5.0: must be at most 4.0")
    assert values(loaded(tmp_path / "low", with_world("left/player_reach: 0.4")))["left/player_far"] == 0.4


def test_a_limit_that_is_no_fixed_parameter_of_the_device_is_refused_with_the_class(tmp_path: Path) -> None:
    told = refusal(tmp_path, player=PLAYER.replace('limit="reach"', 'limit="rech"'))
    assert told.startswith(f"rover/robot.yaml:5: {DEVICE}.class: parameter 'far': its limit 'rech' must be a read-only")
    assert "did you mean 'reach'?" in told
