"""The kit's side of the round trips: a component that pings and one that echoes."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from regraft import Component, Input, Output, service
from regraft.bus_schema.annotations import ByteArray, Count, Seconds
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.sensors import Image

POLL = 0.02
"""Seconds between looks whether a volley is over; far longer than a round trip."""


@message("benchmark/Ball")
@dataclass(frozen=True, slots=True)
class Ball:
    """A small message."""

    number: Count
    data: bytes


@message("benchmark/Volley")
@dataclass(frozen=True, slots=True)
class Volley:
    """Asks for ``count`` round trips of messages with ``size`` bytes of data."""

    count: Count
    size: Count


@message("benchmark/Times")
@dataclass(frozen=True, slots=True)
class Times:
    """How long each round trip took, in seconds."""

    seconds: tuple[Seconds, ...]


class _Timing:
    """Takes the time of one round trip after the other."""

    def __init__(self, count: int) -> None:
        self.left = count
        self._stamps = [time.perf_counter_ns()]

    def back(self) -> bool:
        """Take the time; returns whether there is another round trip to do."""
        self._stamps.append(time.perf_counter_ns())
        self.left -= 1
        return self.left > 0

    def times(self) -> Times:
        """Return what was measured."""
        return Times(tuple((after - before) / 1e9 for before, after in pairwise(self._stamps)))


class Pinger(Component):
    """Sends a ball, waits for it to come back, and sends it again, as often as it is asked to."""

    ping = Output(Ball)
    pong = Input(Ball)

    def __init__(self) -> None:
        self.timing = _Timing(0)
        self.ball = Ball(0, b"")

    @service("volley")
    async def volley(self, ask: Volley) -> Times:
        """Play."""
        self.ball = Ball(ask.count, bytes(ask.size))
        self.timing = _Timing(ask.count)
        self.ping.publish(self.ball)
        while self.timing.left:
            await self.kit.sleep(POLL)
        return self.timing.times()

    @pong.handler
    def back(self, came: Ball) -> None:
        """Send the next."""
        if self.timing.back():
            self.ping.publish(self.ball)


class Echo(Component):
    """Sends every ball back."""

    ping = Input(Ball)
    pong = Output(Ball)

    @ping.handler
    def there(self, ball: Ball) -> None:
        """Send it back."""
        self.pong.publish(ball)


def image(size: int) -> Image:
    """Return an image with ``size`` bytes of pixels, as near as whole pixels go."""
    pixels: ByteArray = np.zeros((1, max(1, size // 3), 3), np.uint8)
    return Image(0.0, "camera", "base_link", Pose(), 1.0, pixels)


class ImagePinger(Component):
    """The same with images."""

    ping = Output(Image)
    pong = Input(Image)

    def __init__(self) -> None:
        self.timing = _Timing(0)
        self.image = image(3)

    @service("image_volley")
    async def volley(self, ask: Volley) -> Times:
        """Play."""
        self.image = image(ask.size)
        self.timing = _Timing(ask.count)
        self.ping.publish(self.image)
        while self.timing.left:
            await self.kit.sleep(POLL)
        return self.timing.times()

    @pong.handler
    def back(self, came: Image) -> None:
        """Send the next."""
        if self.timing.back():
            self.ping.publish(self.image)


class ImageEcho(Component):
    """Sends every image back."""

    ping = Input(Image)
    pong = Output(Image)

    @ping.handler
    def there(self, came: Image) -> None:
        """Send it back."""
        self.pong.publish(came)
