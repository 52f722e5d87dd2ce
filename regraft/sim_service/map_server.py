"""The map of the simulated world, and the places worth visiting in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from regraft import Component, Output, Parameter, Records, every
from regraft.bus_schema.messages.geometry import FramedPose, Pose
from regraft.bus_schema.messages.maps import Goals, NamedGoal, OccupancyGrid
from regraft.bus_schema.model.description import Resources
from regraft.sim_service.devices.core.fitting import fitted
from regraft.sim_service.devices.lidar import Lidar
from regraft.sim_service.robots import RobotSpec
from regraft.sim_service.rooms.loading import load_world
from regraft.sim_service.simulation import Simulation, SimulationSettings
from regraft.sim_service.survey import goals, ground_map
from regraft.sim_service.world import MAP_FRAME


class MapServer(Component):
    """Publishes the map of all that stands still, and the poses to look at the mission's objects from.

    Both are made from the world file and the run's seed, so they fit the running world without asking it. The map is
    cut at the height of the robot's lidar. A robot whose lidar is higher or lower needs a map server of its own.
    """

    handler_timeout = 2.0
    resources = Resources(cpu=0.01, memory=30.0)

    file = Parameter("", "the world's MJCF file, the same as the world's", unit="path", exists=True, read_only=True)
    robots = Records(RobotSpec, "the world's robots, the same as the world's")
    robot = Parameter(
        "", "the robot at whose lidar's height the map is cut, and that is to look at the objects", read_only=True
    )
    group = Parameter("goals", "the MJCF tuple that lists the objects to visit, in order", read_only=True)
    resolution = Parameter(0.05, "side of a map cell", minimum=0.01, maximum=0.5, unit="m", read_only=True)
    rate = Parameter(0.5, "how often the map and the goals are published", minimum=0.01, maximum=10.0, unit="Hz")

    map = Output(OccupancyGrid, description="the map, at the height of the robot's lidar")
    goals = Output(Goals, description="where to look at the objects from, in the order of the visits")

    def on_configure(self) -> None:
        """Make the map and the goals; raises SceneError, PlacementError, GoalError."""
        if not self.file:
            raise ValueError("the parameter 'file' must name the world's MJCF file")
        scene = load_world(self.file, _with_lidars(self.robots), self.kit.seed)
        # No time passes here, so that one step fits a world of any periods.
        step = float(scene.model.opt.timestep)
        simulation = Simulation(scene, self.kit.seed, SimulationSettings(step, step))
        self._ground = ground_map(simulation, self.robot, self.resolution)
        self._goals = tuple(
            NamedGoal(goal.name, FramedPose(MAP_FRAME, Pose.planar(goal.pose.x, goal.pose.y, goal.pose.yaw)))
            for goal in goals(simulation, self.group, self.robot, self.resolution)
        )

    @every(hz=rate)
    def tell(self) -> None:
        """Publish the map and the goals."""
        now, ground = self.kit.now(), self._ground
        origin = Pose.planar(*ground.origin, 0.0)
        self.map.publish(OccupancyGrid(now, MAP_FRAME, ground.resolution, origin, ground.occupancy))
        self.goals.publish(Goals(now, self._goals))


def _with_lidars(robots: Sequence[RobotSpec]) -> tuple[RobotSpec, ...]:
    """Return the robots with their lidars alone: of other devices, the world may have values that are unknown here."""
    lidars = [device for device in fitted(robots) if issubclass(device.cls, Lidar)]
    return tuple(replace(each, devices=tuple(one.spec for one in lidars if one.robot is each)) for each in robots)
