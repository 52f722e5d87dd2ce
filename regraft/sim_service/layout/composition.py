"""Puts robots into a world: MJCF files into one model."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import mujoco

from regraft.planar import Pose2D
from regraft.sim_service.layout.headings import yaw_of_matrix, yaw_quaternion
from regraft.sim_service.robots import RobotSpec

EXACT = 1e-9
"""m and rad by which a base may miss its place; most stand there exactly, and their runs stay as they are."""


class CompositionError(ValueError):
    """A world and its robots make no model; the message names the file and the robot."""


@dataclass(frozen=True, slots=True)
class Composition:
    """The compiled model of a world. ``parts`` has the outermost bodies of each robot's file, by the robot's name."""

    model: mujoco.MjModel
    parts: Mapping[str, tuple[int, ...]]


def unchanged(spec: mujoco.MjSpec) -> None:
    """Leave a world as its file has it."""


def composed(
    world: Path, robots: Sequence[RobotSpec], change: Callable[[mujoco.MjSpec], None] = unchanged
) -> Composition:
    """Compile a world file with its robots; ``change`` may alter it before.

    Raises:
        CompositionError: MuJoCo refuses a file, or a robot has no body, or two have one name.
    """
    names = [robot.name for robot in robots]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise CompositionError(f"two robots have the name {twice[0]!r}: each needs one of its own")
    spec = _read(world)
    with _without_warnings():
        attached = [(robot, *_attach(spec, robot)) for robot in robots if robot.model]
        change(spec)
        try:
            model = spec.compile()
            moved = [_moved(model, robot, frame) for robot, frame, _ in attached]
            if any(moved):
                model = spec.compile()
            return Composition(model, {robot.name: tuple(body.id for body in bodies) for robot, _, bodies in attached})
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


def _attach(world: mujoco.MjSpec, robot: RobotSpec) -> tuple[mujoco.MjsFrame, list[mujoco.MjsBody]]:
    """Put a robot's file into the world, in a frame at the robot's place; return the frame and its bodies."""
    file = Path(robot.model)
    if not file.is_file():
        raise CompositionError(f"{file}: no such MJCF file of the robot {robot.name!r}")
    model = _read(file)
    if model.body(robot.base) is None or robot.base == "world":
        there = ", ".join(body.name for body in model.bodies if body.name != "world") or "none"
        raise CompositionError(f"{file}: the robot {robot.name!r} has no body {robot.base!r}; there are: {there}")
    place = _place(robot)
    frame = world.worldbody.add_frame(pos=[place.x, place.y, 0.0], quat=yaw_quaternion(place.yaw).tolist())
    others = len(world.worldbody.bodies)
    try:
        world.attach(model, frame=frame, prefix=robot.prefix)
    except ValueError as error:
        raise CompositionError(f"{file}: cannot be attached as {robot.name!r}: {error}") from error
    return frame, world.worldbody.bodies[others:]


def _place(robot: RobotSpec) -> Pose2D:
    return Pose2D() if robot.place is None else Pose2D(robot.place.x, robot.place.y, robot.place.yaw)


def _moved(model: mujoco.MjModel, robot: RobotSpec, frame: mujoco.MjsFrame) -> bool:
    """Move the frame of a robot whose base is not at its place, as its own file has it elsewhere."""
    if robot.place is None:
        return False
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    base = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, robot.body))
    x, y, _ = data.xpos[base].tolist()
    place = _place(robot)
    off = place.to(Pose2D(x, y, yaw_of_matrix(data.xmat[base])))
    if max(abs(off.x), abs(off.y), abs(off.yaw)) <= EXACT:
        return False
    aim = place.compose(off.inverse())
    frame.pos, frame.quat = [aim.x, aim.y, 0.0], yaw_quaternion(aim.yaw).tolist()
    return True


def _with(robots: Sequence[RobotSpec]) -> str:
    files = ", ".join(dict.fromkeys(robot.model for robot in robots if robot.model))
    return f" with {files}" if files else ""
