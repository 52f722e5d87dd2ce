"""The map of a simulated world at the height of a robot's lidar, and poses to look at things from."""

from __future__ import annotations

from regraft.sim_service.devices.lidar import Lidar
from regraft.sim_service.layout.goals import ViewingGoal, viewing_goals
from regraft.sim_service.layout.ground_map import GroundMap, Rasteriser
from regraft.sim_service.layout.scene import SceneError
from regraft.sim_service.simulated_robot import SimulatedRobot
from regraft.sim_service.simulation import Simulation


def ground_map(simulation: Simulation, robot: str = "", resolution: float = 0.05) -> GroundMap:
    """Return the grid of all that stands still, at the height of a robot's lidar (resolution in m per cell)."""
    return _rasteriser(simulation, simulation.robot(robot), resolution).map()


def goals(
    simulation: Simulation, group: str = "goals", robot: str = "", resolution: float = 0.05
) -> tuple[ViewingGoal, ...]:
    """Return the poses from which a robot sees each body of the MJCF tuple ``group``, in its order.

    Raises:
        SceneError: there is no such tuple, or the robot has no lidar.
        GoalError: an object cannot be seen from any pose that the robot can reach.
    """
    looking = simulation.robot(robot)
    start = simulation.placement.poses.get(looking.spec.body, looking.pose())
    rasteriser = _rasteriser(simulation, looking, resolution)
    return viewing_goals(simulation.scene, rasteriser, group, start, looking.spec.radius)


def _rasteriser(simulation: Simulation, robot: SimulatedRobot, resolution: float) -> Rasteriser:
    lidar = next((device for device in robot.devices.values() if isinstance(device, Lidar)), None)
    if lidar is None:
        raise SceneError(f"the robot {robot.spec.name!r} has no lidar, at whose height a map could be made")
    return Rasteriser(simulation.scene, simulation.placement, lidar.height(), resolution)
