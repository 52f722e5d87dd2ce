"""A server that takes over from another remembers the obstacles that the other has seen."""

from __future__ import annotations

import pytest

from regraft import Component
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.nav2.paths import Path, PathValidity, PlanarPose, ValidatePath
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.planar import Pose2D
from regraft.services.navigator.servers.behaviour_server import BehaviourServer
from regraft.services.navigator.servers.controller_server import ControllerServer
from regraft.services.navigator.servers.planner_server import PlannerServer
from regraft.testing import Rig

from ..navigator.stage import ROOM, Stage, room_map
from ..navigator.world import Box

START = Pose2D(0.6, 2.0, 0.0)
CHAIR = Box(2.0, 2.0, 0.4, 0.4)
LINE = Path(0.0, "map", tuple(PlanarPose(0.6 + 0.05 * step, 2.0) for step in range(57)))


def replaced(stage: Stage, kind: type[Component]) -> Component:
    """Put a successor in the place of a stage's server; returns it, inactive."""
    rig = stage.rig
    snapshot = codec.encode(rig.runtimes["navigator"].checkpoints.snapshot())
    rig.transition("navigator", Transition.DEACTIVATE)
    successor = rig.add(kind, "successor", state=State.INACTIVE)
    state = codec.unpack_plain(snapshot)["state"]
    successor.restore(state)
    assert successor.snapshot() == state
    rig.runtimes.pop("navigator").leave()
    return successor


@pytest.mark.parametrize("kind", [PlannerServer, BehaviourServer, ControllerServer])
def test_a_successor_remembers_what_was_seen(kind: type[Component]) -> None:
    with Rig() as rig:
        stage = Stage.of(rig, kind, START)
        stage.robot.boxes = [*ROOM, CHAIR]
        stage.run(1.0)
        marks = replaced(stage, kind).snapshot()["sight"]["marks"]
        assert len(marks) > 2


def test_a_path_through_what_a_predecessor_has_seen_is_invalid() -> None:
    with Rig() as rig:
        stage = Stage.of(rig, PlannerServer, START)
        stage.robot.boxes = [*ROOM, CHAIR]
        stage.run(1.0)
        replaced(stage, PlannerServer)
        stage.scans = False
        rig.transition("successor", Transition.ACTIVATE)
        stage.show_map(room_map(ROOM))
        stage.run(0.3)
        found = rig.call("is_path_valid", ValidatePath(LINE), PathValidity)
        assert (found.success, found.is_valid) == (True, False)
