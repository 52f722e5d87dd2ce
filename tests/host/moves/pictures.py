"""Pictures at 30 Hz that pass through a component which can be moved."""

from __future__ import annotations

import numpy as np

from regraft import Component, Input, Output, every, service
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.sensors import Image
from tests.handover.parts import Ask, Item, Totaller

SHAPE = (240, 320, 3)


class Painter(Component):
    """Numbers pictures, by their stamp."""

    pictures = Output(Image)

    def on_configure(self) -> None:
        self.number = 0

    @every(hz=30)
    def paint(self) -> None:
        self.number += 1
        pixels = np.full(SHAPE, self.number % 256, np.uint8)
        self.pictures.publish(Image(float(self.number), "camera", "map", Pose(), 1.0, pixels))


class Looker(Totaller):
    """Passes pictures on, besides."""

    pictures = Input(Image)
    seen = Output(Image)

    @pictures.handler
    def look(self, image: Image) -> None:
        self.seen.publish(image)


class Viewer(Component):
    """Counts pictures, and those that are not the next."""

    seen = Input(Image)

    def on_configure(self) -> None:
        self.count = self.wrong = self.last = 0

    @seen.handler
    def view(self, image: Image) -> None:
        number = int(image.stamp)
        self.wrong += bool(self.last) and number != self.last + 1
        self.wrong += int(image.pixels[-1, -1, -1]) != number % 256
        self.last = number
        self.count += 1

    @service("viewed")
    def viewed(self, ask: Ask) -> Item:
        """Return how many pictures came, and how many of them were wrong."""
        return Item(self.count, self.wrong)
