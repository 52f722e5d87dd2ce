"""Folders of stacks and robots to test with."""

from __future__ import annotations

from pathlib import Path

from regraft.stack import Problem, Stack, StackError, load
from tests.stack.reading.files import line_of

ROBOT = """\
model: rover.xml
parameters: {speed: 0.2, beams: 90, horn: sounds/horn.wav}
devices:
  drive: {class: "devices:Drive", parameters: {limit: $speed}}
  lidar: {class: "devices:Lidar", parameters: {beams: $beams}}
topics:
  odometry: regraft/Odometry
  scan: {type: regraft/LaserScan, sensor_stream: true}
  velocity: regraft/Twist
components:
  eyes: {class: "tests.stack.parts:Eyes"}
  navigator:
    class: tests.stack.parts:Navigator
    parameters: {max_velocity: $speed}
constraints:
  - {parameter: navigator.max_velocity, at_most: 0.25}
modes:
  slow:
    - {change: set_parameters, component: navigator, parameters: {max_velocity: 0.1}}
"""
TWO = """\
system: two
clock: simulated
world: room.xml
robots:
  left: {robot: rover, place: {x: 1.0}}
  right: {robot: rover, parameters: {speed: 0.1}, devices: {lidar: {parameters: {beams: 30}}}}
components:
  world: {class: "tests.stack.parts:Fleet", parameters: {file: $world, robots: $robots}}
"""
SINGLE = TWO.replace(
    """\
robots:
  left: {robot: rover, place: {x: 1.0}}
  right: {robot: rover, parameters: {speed: 0.1}, devices: {lidar: {parameters: {beams: 30}}}}
""",
    "robot: rover\n",
)


def write_all(folder: Path, **files: str) -> Path:
    """Write files, ``base`` being base.yaml and ``rover_robot`` rover/robot.yaml; return the path of stack.yaml."""
    for name, text in files.items():
        path = folder / f"{name.replace('_', '/')}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder / "stack.yaml"


def rovers(folder: Path, stack: str = TWO, robot: str = ROBOT, **files: str) -> Path:
    """Write a stack of rovers; return the path of its file."""
    path = write_all(folder, stack=stack, rover_robot=robot, **files)
    for model in (folder / "room.xml", folder / "rover" / "rover.xml"):
        model.write_text("<mujoco/>")
    return path


def loaded(folder: Path, **files: str) -> Stack:
    """Return the stack of files."""
    return load(write_all(folder, **files))


def told(file: Path) -> list[str]:
    """Return what is wrong with a stack, each with the files as from its folder; fails if nothing is."""
    return [str(problem).replace(f"{file.parent}/", "") for problem in found(file)]


def found(file: Path) -> tuple[Problem, ...]:
    """Return what is wrong with a stack; fails if nothing is."""
    try:
        load(file)
    except StackError as error:
        return error.problems
    raise AssertionError("the stack was taken for good")


def at(file: str, text: str, piece: str) -> str:
    """Return how a problem begins whose cause is a piece of a file's text."""
    return f"{file}:{line_of(text, piece)}: "
