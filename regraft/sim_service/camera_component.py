"""A camera of a simulated world, as a component."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from regraft import Output, Parameter
from regraft.bus_schema.messages.sensors import Image
from regraft.sim_service.cameras.camera import Camera as Eye
from regraft.sim_service.cameras.camera import CameraSettings, RenderState, SensorNoise
from regraft.sim_service.cameras.camera import Image as Pixels
from regraft.sim_service.world_camera import View, WorldCamera


class Camera(WorldCamera):
    """Renders the pictures of one camera of the world, when they are due and somebody wants them.

    See `WorldCamera` for when it takes pictures and how it can be made to fail.
    """

    pictures = "image"

    always_lit = Parameter(False, "whether it sees full light however dark it is", read_only=True)
    full_well = Parameter(
        600.0,
        "electrons that white fills a pixel with: fewer give more noise; 0: none",
        minimum=0.0,
        read_only=True,
    )
    read_noise = Parameter(4.0, "electrons of noise in reading a pixel", minimum=0.0, read_only=True)

    image = Output(Image, description="the pictures")

    def settings(self, settings: CameraSettings) -> CameraSettings:
        """Return the settings with light and noise."""
        noise = SensorNoise(self.full_well, self.read_noise) if self.full_well else None
        return replace(settings, always_lit=self.always_lit, noise=noise)

    def take(self, eye: Eye, moment: RenderState) -> Pixels:
        """Return the picture of a moment."""
        return eye.render(moment)

    def black(self, width: int, height: int) -> Pixels:
        """Return a black picture."""
        return np.zeros((height, width, 3), np.uint8)

    def message(self, view: View, pixels: Pixels) -> Image:
        """Return the message with a picture."""
        return Image(view.stamp, view.frame, view.pose_frame, view.pose, view.horizontal_field_of_view, pixels)
