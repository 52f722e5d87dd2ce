"""A depth camera of a simulated world, as a component."""

from __future__ import annotations

from typing import Any

import numpy as np

from regraft import Output, Parameter
from regraft.bus_schema.messages.sensors import DepthImage
from regraft.component.parameters import ParameterError
from regraft.sim_service.cameras.camera import Camera as Eye
from regraft.sim_service.cameras.camera import Depths, RenderState
from regraft.sim_service.layout.random_streams import generator
from regraft.sim_service.world_camera import View, WorldCamera


class DepthCamera(WorldCamera):
    """Measures how far away is what one camera of the world sees, when that is due and somebody wants it.

    The deviation of a depth z is ``noise`` * z squared. The defaults are a Kinect's: 0.5 to 5 m, with 4 cm at 5 m
    (K. Khoshelham, S. O. Elberink: Accuracy and resolution of Kinect depth data, Sensors 12(2), 2012).
    A black camera finds nothing anywhere. See `WorldCamera` for all else.
    """

    pictures = "depth"

    range_min = Parameter(0.5, "nearest that it measures", minimum=0.0, unit="m", read_only=True)
    range_max = Parameter(5.0, "farthest that it measures", minimum=0.01, unit="m", read_only=True)
    noise = Parameter(0.0016, "standard deviation of a depth of 1 m", minimum=0.0, unit="m", read_only=True)

    depth = Output(DepthImage, description="the depths")

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Refuse a camera that would measure nothing."""
        _check_reach(parameters["range_min"], parameters["range_max"])

    def on_configure(self) -> None:
        """Load the world and get the renderer ready; raises ParameterError, SceneError."""
        _check_reach(self.range_min, self.range_max)
        super().on_configure()

    def take(self, eye: Eye, moment: RenderState) -> Depths:
        """Return the depths of a moment as the sensor measures them."""
        true = eye.depths(moment)
        # A depth beyond reach must not become infinity times a random number.
        depths = np.minimum(true, np.float32(self.range_max))
        if self.noise > 0.0:
            random = generator(self.kit.seed, f"depth {self.kit.name}", moment.step)
            depths += np.float32(self.noise) * depths**2 * random.standard_normal(depths.shape, np.float32)
        return np.where(true > self.range_max, np.inf, np.where(true < self.range_min, -np.inf, depths)).astype(
            np.float32
        )

    def black(self, width: int, height: int) -> Depths:
        """Return the depths where nothing is found."""
        return np.full((height, width), np.inf, np.float32)

    def message(self, view: View, pixels: Depths) -> DepthImage:
        """Return the message with depths."""
        return DepthImage(
            view.stamp,
            view.frame,
            view.pose_frame,
            view.pose,
            view.horizontal_field_of_view,
            self.range_min,
            self.range_max,
            pixels,
        )


def _check_reach(nearest: float, farthest: float) -> None:
    if nearest >= farthest:
        raise ParameterError([("range_max", f"{farthest:g} m: must be above range_min, {nearest:g} m")])
