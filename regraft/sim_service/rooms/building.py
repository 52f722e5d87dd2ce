"""Making MJCF of a room that was drawn."""

from __future__ import annotations

import mujoco
import numpy as np

from regraft.sim_service.layout.headings import yaw_quaternion
from regraft.sim_service.rooms.blocks import Block, Room
from regraft.sim_service.rooms.words import GOALS


def build(room: Room, spec: mujoco.MjSpec) -> None:
    """Put walls and boxes into a world, set its lamps, and have the boxes visited that are goals."""
    if room.walls:
        body = spec.worldbody.add_body(name=room.body)
        for wall in room.walls:
            _add(body, wall, (wall.x, wall.y))
    for box in room.boxes:
        quaternion = yaw_quaternion(box.yaw).tolist()
        body = spec.worldbody.add_body(name=box.name, pos=[box.x, box.y, 0.0], quat=quaternion)
        _add(body, box, (0.0, 0.0))
    for lamp in (*spec.lights, spec.visual.headlight):
        lamp.diffuse = np.asarray(lamp.diffuse) * room.lamps
    headlight = spec.visual.headlight
    headlight.ambient = np.asarray(headlight.ambient) * room.lamps
    if room.goals:
        _visit(spec, room.goals)


def _add(body: mujoco.MjsBody, block: Block, place: tuple[float, float]) -> None:
    half_height = block.height / 2.0
    geom = body.add_geom(
        name=block.name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[*place, half_height],
        size=[block.half_x, block.half_y, half_height],
    )
    if block.material:
        geom.material = block.material


def _visit(spec: mujoco.MjSpec, names: tuple[str, ...]) -> None:
    """Put bodies before those that the tuple of goals lists, if the file has it."""
    goals = spec.tuple(GOALS) or spec.add_tuple(name=GOALS)
    goals.objname = [*names, *goals.objname]
    goals.objtype = [int(mujoco.mjtObj.mjOBJ_BODY)] * len(names) + list(goals.objtype)
    goals.objprm = [0.0] * len(names) + list(goals.objprm)
