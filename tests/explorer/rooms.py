"""Rooms made of boxes, and a robot without weight that reveals them by a ray-cast lidar."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from regraft.bus_schema.messages import geometry, maps, sensors
from regraft.services.explorer.ground import Ground, Mask
from regraft.services.navigator.planning.grid import OccupancyGrid
from regraft.sim_service import survey
from regraft.sim_service.simulation import Simulation

RESOLUTION = 0.05
RANGE = 3.5
BEAMS = 360
RADIUS = 0.22


@dataclass(frozen=True)
class Room:
    """A true room: `walls` (rows, columns) says which cells are solid; the corner of cell (0, 0) is at (x, y) m."""

    walls: Mask
    x: float
    y: float

    def grid(self) -> OccupancyGrid:
        """Return the map of somebody who knows everything."""
        return OccupancyGrid(np.where(self.walls, 100, 0).astype(np.int8), RESOLUTION, self.x, self.y)

    def ground(self, start: tuple[float, float]) -> Ground:
        """Return the true ground as seen from a place."""
        return Ground.of(self.grid(), start, RADIUS)


def room_of(columns: int, rows: int, boxes: list[tuple[int, int, int, int]]) -> Room:
    """Return a walled room of free cells with boxes (column, row, width, height in cells) in it."""
    walls = np.zeros((rows + 12, columns + 12), bool)
    walls[3:-3, 3:-3] = True
    walls[6:-6, 6:-6] = False
    for column, row, width, height in boxes:
        walls[6 + row : 6 + row + height, 6 + column : 6 + column + width] = True
    return Room(walls, -RESOLUTION * (6 + columns // 2), -RESOLUTION * (6 + rows // 2))


def frog_room(simulation: Simulation) -> Room:
    """Return FROG's room as it stands in a simulation, cut at the height of the lidar."""
    truth = survey.ground_map(simulation, resolution=RESOLUTION)
    return Room(truth.occupancy > 0, *truth.origin)


class Mapped:
    """What the lidar has shown of a room so far; noise (m, standard deviation) is that of its ranges."""

    def __init__(self, room: Room, noise: float = 0.0, seed: int = 0) -> None:
        self.room = room
        self.cells: NDArray[np.int8] = np.full(room.walls.shape, -1, np.int8)
        self._misses = np.zeros(room.walls.shape, np.int32)
        self._hits = np.zeros(room.walls.shape, np.int32)
        self._noise = noise
        self._random = np.random.default_rng(seed)

    def reveal(self, x: float, y: float) -> None:
        """Look round once from a place (m)."""
        step = RESOLUTION / 2
        angles = np.arange(BEAMS) * math.tau / BEAMS
        distances = np.arange(step, RANGE, step)
        away_x, away_y = np.outer(distances, np.cos(angles)), np.outer(distances, np.sin(angles))
        rows = np.floor((y - self.room.y + away_y) / RESOLUTION).astype(int).clip(0, self.room.walls.shape[0] - 1)
        columns = np.floor((x - self.room.x + away_x) / RESOLUTION).astype(int).clip(0, self.room.walls.shape[1] - 1)
        solid = self.room.walls[rows, columns]
        hit, first = solid.any(axis=0), solid.argmax(axis=0)
        error = self._random.normal(0.0, self._noise, BEAMS) if self._noise else np.zeros(BEAMS)
        ends = np.where(hit, (first + error / step).round().astype(int).clip(0, len(distances) - 1), len(distances))
        passed = np.arange(len(distances))[:, None] < ends
        self._count(self._misses, rows[passed], columns[passed])
        beams = np.nonzero(hit)[0]
        self._count(self._hits, rows[ends[beams], beams], columns[ends[beams], beams])
        self._misses[rows[0, 0], columns[0, 0]] += 1
        known = (self._misses + self._hits) > 0
        occupied = known & (3 * self._hits > self._misses)
        self.cells[known] = 0
        self.cells[occupied] = 100

    def grid(self) -> OccupancyGrid:
        """Return the map so far."""
        return OccupancyGrid(self.cells.copy(), RESOLUTION, self.room.x, self.room.y)

    def message(self, stamp: float) -> maps.OccupancyGrid:
        """Return the map so far as a message."""
        origin = geometry.Pose.planar(self.room.x, self.room.y, 0.0)
        return maps.OccupancyGrid(stamp, "map", RESOLUTION, origin, self.cells.copy())

    @staticmethod
    def _count(counts: NDArray[np.int32], rows: NDArray[np.intp], columns: NDArray[np.intp]) -> None:
        # A beam that ends in a cell says it once, however many of its samples lie there.
        touched = np.unique(rows * counts.shape[1] + columns)
        counts.ravel()[touched] += 1


def odometry(stamp: float, x: float, y: float, yaw: float = 0.0) -> sensors.Odometry:
    """Return the robot's place in the map as a message."""
    return sensors.Odometry(stamp, "map", "base_link", geometry.Pose.planar(x, y, yaw), geometry.Twist())


def standing_places(room: Room) -> list[tuple[float, float]]:
    """Return where (m) a robot can stand in a room, anywhere."""
    ground = room.ground((0.0, 0.0))
    rows, columns = np.nonzero(ground.clearance >= 0.30)
    return [(x, y) for x, y in room.grid().centres(rows, columns).tolist()]
