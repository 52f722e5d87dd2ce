"""Small worlds and shortcuts for the tests."""

from regraft.planar import Pose2D
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import Scene
from regraft.sim_service.simulation import Simulation
from tests.support.paths import ROOT
from tests.support.worlds import Values, frog_scene, send_command

FROG = ROOT / "regraft" / "stacks" / "frog" / "world.xml"

OUT_OF_THE_WAY = {
    "hydrant": Pose2D(1.6, 1.7, 0.0),
    "red_box": Pose2D(1.8, -1.8, 0.0),
    "orange_ball": Pose2D(-1.8, 1.9, 0.0),
}


def frog(**devices: Values) -> Scene:
    """Return the world of the FROG stack; ``devices`` gives parameters by device."""
    return frog_scene(**devices)


def frog_with_robot_at(x: float, y: float, yaw: float, **devices: Values) -> Simulation:
    """Return FROG with the robot at a pose and the placed objects in the corners."""
    placement = Placement({**OUT_OF_THE_WAY, "base": Pose2D(x, y, yaw)})
    return Simulation(frog(**devices), seed=1, placement=placement)


def drive(simulation: Simulation, v: float, w: float, seconds: float) -> None:
    """Command a twist at every world tick for some time."""
    tick = simulation.settings.tick
    for _ in range(round(seconds / tick)):
        send_command(simulation, v, w)
        simulation.advance(tick)
