"""Puts robots into a world: MJCF files into one model."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import mujoco

from regraft.sim_service.layout.headings import yaw_quaternion
from regraft.sim_service.robots import RobotSpec


class CompositionError(ValueError):
    """A world and its robots make no model; the message names the file and the robot."""


def unchanged(spec: mujoco.MjSpec) -> None:
    """Leave a world as its file has it."""


def composed(
    world: Path, robots: Sequence[RobotSpec], change: Callable[[mujoco.MjSpec], None] = unchanged
) -> mujoco.MjModel:
    """Return the compiled model of a world file with its robots; ``change`` may alter it before.

    Raises:
        CompositionError: MuJoCo refuses a file, or a robot has no body, or two have one name.
    """
    names = [robot.name for robot in robots]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise CompositionError(f"two robots have the name {twice[0]!r}: each needs one of its own")
    spec = _read(world)
    with _without_warnings():
        for robot in robots:
            if robot.model:
                _attach(spec, robot)
        change(spec)
        try:
            return spec.compile()
        except ValueError as error:
            raise CompositionError(f"{world}{_with(robots)}: {error}") from error


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Drop MuJoCo's warning that a model with short names may not be saved as MJCF again: it never is."""
    handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            yield
    finally:
        mujoco.set_mju_user_warning(handler)


def _read(file: Path) -> mujoco.MjSpec:
    try:
        return mujoco.MjSpec.from_file(str(file))
    except ValueError as error:
        raise CompositionError(f"{file}: {error}") from error


def _attach(world: mujoco.MjSpec, robot: RobotSpec) -> None:
    file = Path(robot.model)
    if not file.is_file():
        raise CompositionError(f"{file}: no such MJCF file of the robot {robot.name!r}")
    model = _read(file)
    if model.body(robot.base) is None or robot.base == "world":
        there = ", ".join(body.name for body in model.bodies if body.name != "world") or "none"
        raise CompositionError(f"{file}: the robot {robot.name!r} has no body {robot.base!r}; there are: {there}")
    x, y, yaw = (0.0, 0.0, 0.0) if robot.place is None else (robot.place.x, robot.place.y, robot.place.yaw)
    frame = world.worldbody.add_frame(pos=[x, y, 0.0], quat=yaw_quaternion(yaw).tolist())
    try:
        world.attach(model, frame=frame, prefix=robot.prefix)
    except ValueError as error:
        raise CompositionError(f"{file}: cannot be attached as {robot.name!r}: {error}") from error


def _with(robots: Sequence[RobotSpec]) -> str:
    files = ", ".join(dict.fromkeys(robot.model for robot in robots if robot.model))
    return f" with {files}" if files else ""
