"""Occupancy grids made from a world."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from regraft.sim_service.layout.footprints import world_box
from regraft.sim_service.layout.placement import Placement
from regraft.sim_service.layout.scene import Scene, SceneError
from regraft.sim_service.layout.solids import inside

FREE = 0
OCCUPIED = 100
SAMPLES = 5
"""Points per cell and direction that are looked at."""
UPRIGHT = np.eye(3).ravel()
"""The rotation of a geom along the axes."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class GroundMap:
    """An occupancy grid in the map frame.

    `occupancy` is (rows along y, columns along x) of int8, 0 free and 100 occupied; `resolution` is m per
    cell; `origin` is (x, y in m) of the outer corner of cell [0, 0].
    """

    occupancy: npt.NDArray[np.int8]
    resolution: float
    origin: tuple[float, float]

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return (row, column) of the cell at a point (m, map frame), which may lie outside the grid."""
        column = math.floor((x - self.origin[0]) / self.resolution)
        return math.floor((y - self.origin[1]) / self.resolution), column

    def is_free(self, x: float, y: float) -> bool:
        """Return whether the cell at a point (m, map frame) lies in the grid and is free."""
        row, column = self.cell(x, y)
        rows, columns = self.occupancy.shape
        return 0 <= row < rows and 0 <= column < columns and bool(self.occupancy[row, column] == FREE)


class Rasteriser:
    """Cuts the static geoms of a placed world at one height (m) into cells (resolution in m).

    The grid reaches just round everything that stands on the floor.

    Raises:
        SceneError: the world has no static geoms but floors, or one of a shape that can't be cut.
    """

    def __init__(self, scene: Scene, placement: Placement, height: float, resolution: float) -> None:
        self._model = scene.new_model()
        self._data = mujoco.MjData(self._model)
        placement.apply(scene, self._model, self._data.qpos)
        mujoco.mj_kinematics(self._model, self._data)
        self._scene = scene
        self._height = height
        self._resolution = resolution
        boxes = [world_box(self._model, self._data, geom) for geom in self._standing()]
        if not boxes:
            raise SceneError(f"{scene.path}: no static geoms to make a map of")
        low = np.min([box[0][:2] for box in boxes], axis=0)
        high = np.max([box[1][:2] for box in boxes], axis=0)
        first = np.floor(low / resolution)
        self._origin = (float(first[0]) * resolution, float(first[1]) * resolution)
        columns, rows = (np.ceil(high / resolution) - first).astype(int)
        self._shape = (int(rows), int(columns))

    def map(self) -> GroundMap:
        """Return the grid of all static geoms."""
        occupied = np.where(self._cells(self._standing()), OCCUPIED, FREE).astype(np.int8)
        return GroundMap(occupied, self._resolution, self._origin)

    def body_cells(self, body: str) -> npt.NDArray[np.bool_]:
        """Return the mask, in the shape of the grid, of the cells that one body occupies."""
        return self._cells(self._scene.geoms_of(self._scene.index("body", body)))

    def _standing(self) -> list[int]:
        model = self._model
        plane = int(mujoco.mjtGeom.mjGEOM_PLANE)
        return [
            geom
            for geom in range(model.ngeom)
            if int(model.geom_type[geom]) != plane and self._scene.is_static(int(model.geom_bodyid[geom]))
        ]

    def _cells(self, geoms: list[int]) -> npt.NDArray[np.bool_]:
        mask = np.zeros(self._shape, bool)
        for geom in geoms:
            self._add(mask, geom)
        return mask

    def _add(self, mask: npt.NDArray[np.bool_], geom: int) -> None:
        low, high = world_box(self._model, self._data, geom)
        if not low[2] <= self._height <= high[2]:
            return
        first = np.floor((low[:2] - self._origin) / self._resolution).astype(int)
        last = np.ceil((high[:2] - self._origin) / self._resolution).astype(int)
        columns = np.arange(max(first[0], 0), min(last[0], self._shape[1]))
        rows = np.arange(max(first[1], 0), min(last[1], self._shape[0]))
        within = (np.arange(SAMPLES) + 0.5) / SAMPLES
        x = self._origin[0] + (columns[:, None] + within).ravel() * self._resolution
        y = self._origin[1] + (rows[:, None] + within).ravel() * self._resolution
        hits = self._upright_box(geom, x, y) if self._is_upright_box(geom) else self._inside(geom, x, y)
        by_cell = hits.reshape(len(rows), SAMPLES, len(columns), SAMPLES).any(axis=(1, 3))
        mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] |= by_cell

    def _inside(self, geom: int, x: Floats, y: Floats) -> npt.NDArray[np.bool_]:
        """Return for each y and x (m, world frame) whether the geom contains the point at the grid's height."""
        points = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), self._height)], axis=-1)
        local = (points - self._data.geom_xpos[geom]) @ self._data.geom_xmat[geom].reshape(3, 3)
        shape, size = int(self._model.geom_type[geom]), self._model.geom_size[geom]
        return inside(self._scene, shape, size, local)

    def _is_upright_box(self, geom: int) -> bool:
        is_box = int(self._model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_BOX)
        return is_box and bool(np.array_equal(self._data.geom_xmat[geom], UPRIGHT))

    def _upright_box(self, geom: int, x: Floats, y: Floats) -> npt.NDArray[np.bool_]:
        """Return what `_inside` does, for a box along the axes: large buildings have millions of points."""
        middle, size = self._data.geom_xpos[geom], self._model.geom_size[geom]
        within_x, within_y = np.abs(x - middle[0]) <= size[0], np.abs(y - middle[1]) <= size[1]
        return np.asarray(within_y[:, None] & within_x, bool)
