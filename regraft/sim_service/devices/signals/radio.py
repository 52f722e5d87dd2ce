"""Radios, which reach those of other robots."""

import math
from collections.abc import Mapping
from typing import Any

from regraft import Input, Output, Parameter
from regraft.bus_schema.messages.devices.signals import RadioMessage, RadioReception
from regraft.sim_service.devices.core.device import Device
from regraft.sim_service.devices.core.failure_schedule import DROPOUT, NONE, SILENT
from regraft.sim_service.devices.signals.sight import obstacles, root_of

NEAREST = 0.1
"""m: the law of the loss holds from about a wavelength on."""


class Radio(Device):
    """Broadcasts messages, and receives those of the other robots' radios in the tick after.

    The path loss is that of ITU-R P.1238: 20 log10(frequency) + ``exponent`` log10(distance) - 28 dB. The exponent is
    30 in offices. Each thing between adds ``wall_loss``: 3.4 dB for a light wall (COST 231 multi-wall model). Each
    reception fades by a normal deviate of 8 dB, P.1238's in homes. Power and sensitivity are those of a CC2420 (Texas
    Instruments SWRS041). A message is received if its signal is at least as strong as the sensitivity. Messages do not
    collide. A silent radio neither sends nor receives; a dropout loses some of what arrives.
    """

    send = Input(RadioMessage, description="what to broadcast", required=False)
    received = Output(RadioReception, description="what other robots broadcast")

    site = Parameter("radio", "the MJCF site of its aerial", read_only=True)
    power = Parameter(0.0, "power that it sends with", unit="dBm")
    sensitivity = Parameter(-95.0, "weakest signal that it receives", unit="dBm", read_only=True)
    frequency = Parameter(2450.0, "frequency", minimum=300.0, unit="MHz", read_only=True)
    exponent = Parameter(30.0, "loss for ten times the distance", minimum=0.0, unit="dB", read_only=True)
    wall_loss = Parameter(3.4, "loss for each thing between", minimum=0.0, unit="dB", read_only=True)
    fading = Parameter(8.0, "standard deviation of a signal", minimum=0.0, unit="dB", read_only=True)
    failure = Parameter(NONE, "how it fails now", choices=(NONE, SILENT, DROPOUT))
    dropout = Parameter(0.5, "share of the messages that a dropout loses", minimum=0.0, maximum=1.0)

    def build(self) -> None:
        """Find the site; raises SceneError."""
        self.site_index = self.kit.index("site", self.site)
        self.root = root_of(self.kit, self.site_index)
        self._queued: list[str] = []
        self.on_air: list[str] = []
        """The payloads that other radios can receive at this tick."""

    @send.handler
    def on_send(self, message: RadioMessage) -> None:
        """Broadcast a message at the next tick."""
        if self.kit.failing != SILENT:
            self._queued.append(message.payload)

    def tick(self) -> None:
        """Put on the air what was queued since the last tick; what a silent radio has queued is lost."""
        self.on_air = [] if self.kit.failing == SILENT else self._queued
        self._queued = []

    def sense(self) -> None:
        """Publish what arrives."""
        for message in self.arriving():
            self.received.publish(message)

    def arriving(self) -> list[RadioReception]:
        """Return what arrives at this tick, in the order of the robots and of what they sent."""
        if self.kit.failing == SILENT:
            return []
        return [
            reception
            for robot, radio in self.kit.others_of(Radio)
            if radio.on_air
            for reception in self._from(robot, radio)
        ]

    def mean_signal(self, radio: "Radio") -> float:
        """Return the mean strength (dBm) with which another radio's signal arrives now."""
        data = self.kit.data
        here, there = data.site_xpos[self.site_index], data.site_xpos[radio.site_index]
        distance = max(NEAREST, math.dist(here, there))
        loss = 20.0 * math.log10(radio.frequency) + self.exponent * math.log10(distance) - 28.0
        return radio.power - loss - self.wall_loss * obstacles(self.kit, here, there, self.root, radio.root)

    def _from(self, robot: str, radio: "Radio") -> list[RadioReception]:
        kit, mean = self.kit, self.mean_signal(radio)
        # Each sender has chances of its own: one more radio in the world does not change them.
        random = kit.random(f"{kit.name} {robot} {radio.kit.name}", kit.progress.tick)
        receptions = []
        for payload in radio.on_air:
            signal = mean + self.fading * float(random.standard_normal())
            lost = float(random.random()) < self.dropout and kit.failing == DROPOUT
            if signal >= self.sensitivity and not lost:
                receptions.append(RadioReception(kit.stamp, robot, payload, signal))
        return receptions

    def snapshot(self) -> dict[str, Any]:
        """Return what is queued and on the air."""
        return {"queued": list(self._queued), "on_air": list(self.on_air)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what is queued and on the air."""
        self._queued, self.on_air = list(state["queued"]), list(state["on_air"])
