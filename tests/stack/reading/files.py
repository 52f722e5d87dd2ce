"""Stack files to test with."""

from __future__ import annotations

from pathlib import Path

from regraft.stack import Problem, Stack, StackError, load

GOOD = """\
system: frog
clock: simulated
seed: 1
speed: max
duration: 120
topics:
  odometry: {type: regraft/Odometry, rate: 20}
  scan: {type: regraft/LaserScan, rate: 5, sensor_stream: true}
  velocity: regraft/Twist
  truth: regraft/Odometry
components:
  world:
    class: tests.stack.parts:World
    parameters: {file: world.xml, tick_rate: 10}
  rescuer.navigator:
    class: tests.stack.parts:Navigator
    parameters:
      max_velocity: 0.2
      gains: [1, 2.5]
    connect:
      odometry: odometry
    services: {navigate_to: rescuer/navigate_to}
    restart: {when: on_failure, limit: 3}
  recorder:
    command: [python, -m, recorder]
    managed: false
    inputs: {scan: regraft/LaserScan}
    parameters: {depth: 3, folder: runs}
    restart: never
    state: inactive
constraints:
  - at_least_one_active: [world, rescuer.navigator]
    because: somebody must work
  - parameter: rescuer.navigator.max_velocity
    at_most: 0.26
"""


def write(folder: Path, text: str) -> Path:
    """Write a stack file; return its path."""
    file = folder / "stack.yaml"
    file.write_text(text)
    return file


def good(folder: Path) -> Stack:
    """Return the good stack."""
    return load(write(folder, GOOD))


def problems(folder: Path, text: str) -> tuple[Problem, ...]:
    """Return what is wrong with a stack file; fails if nothing is."""
    return problems_of(write(folder, text))


def problems_of(file: Path) -> tuple[Problem, ...]:
    """Return what is wrong with the stack at a path; fails if nothing is."""
    try:
        load(file)
    except StackError as error:
        return error.problems
    raise AssertionError("the stack was taken for good")


def changed(*changes: tuple[str, str]) -> str:
    """Return the good stack's text with pieces of it replaced."""
    text = GOOD
    for old, new in changes:
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in the good stack"
        text = text.replace(old, new)
    return text


def line_of(text: str, piece: str) -> int:
    """Return the line, from 1, in which a piece of text first stands."""
    return text[: text.index(piece)].count("\n") + 1
