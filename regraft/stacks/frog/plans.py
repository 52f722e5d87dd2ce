"""FROG's internal adaptation plans (ReBeT, section IV-B): how fast to drive, and how to look for the hydrant.

The executor finds them by its parameter ``nodes: regraft.stacks.frog.plans:PLANS``.
"""

from __future__ import annotations

from typing import Any

from behavior_tree import Input
from regraft.services.bt_executor.adaptation import (
    AdaptOnStart,
    AdaptPeriodically,
    Connect,
    DesiredChange,
    SetParameters,
    Step,
)
from regraft.services.bt_executor.adaptation.port_values.names import read_names
from regraft.services.power_model import PICTURE_ENERGY
from regraft.stacks.frog.utility import FASTEST

SLOWEST, STEP = 0.10, 0.08
"""m/s: the least maximum velocity, and what one decision changes."""

PICTURES_IN_THE_DARK = 3
SPARE_PICTURES = 2
"""Pictures that are kept in reserve next to one for each look that is still to come."""


class AdjustMaxVelocity(AdaptPeriodically):
    """Drives more slowly near obstacles or when driving costs much, and faster again when neither is so.

    The published plan's limits of 40 and 39 sum one sample of power every 2 s: here 80 and 78 J.
    """

    subject_location = Input[Any](default="navigator", description="what drives")
    adaptation_subject = Input[Any](default="max_velocity", description="its parameter, in m/s")
    adaptation_period = Input[Any](default="3s", description="the interval")
    safety = Input(float, description="distance to the nearest obstacle as a share of the range, 0 to 1")
    leg_energy = Input(float, description="what driving to the present goal has taken, in J")
    too_near = Input(float, default=0.10, description="safety below which to slow down")
    far_enough = Input(float, default=0.15, description="safety above which to speed up")
    too_much = Input(float, default=80.0, description="energy in J above which to slow down")
    little_enough = Input(float, default=78.0, description="energy in J below which to speed up")

    def plan(self) -> DesiredChange | None:
        """Return a step down or up."""
        safety, energy = self.safety, self.leg_energy
        if safety < self.too_near or energy > self.too_much:
            return self.stepped(-1)
        if safety > self.far_enough or energy < self.little_enough:
            return self.stepped(+1)
        return None

    def stepped(self, sign: int) -> DesiredChange:
        """Return a step by 0.08 m/s, down or up."""
        return Step(*self.target(), sign * STEP, SLOWEST, FASTEST)


class AdjustMaxVelocityAmong(AdjustMaxVelocity):
    """The same among any speeds: the next slower or faster one."""

    speeds = Input[Any](default="0.10;0.17;0.26", description="what there is to choose from in m/s, as a;b")

    def stepped(self, sign: int) -> DesiredChange:
        """Return the next speed down or up."""
        component, parameter = self.target()
        now = float(self.current(component, parameter))
        speeds = sorted(map(float, read_names(self.speeds)))
        beyond = [speed for speed in speeds if (speed - now) * sign > 0.0]
        chosen = min(beyond, key=lambda speed: abs(speed - now), default=speeds[0] if sign < 0 else speeds[-1])
        return SetParameters(component, {parameter: chosen})


class AdjustDetectionAttempts(AdaptOnStart):
    """Takes more pictures in the dark as long as the budget lasts, else looks through the camera in the corner.

    Only pictures of the robot's own camera count against the budget; when it is light and there is energy left, the
    robot looks for itself again.
    """

    subject_location = Input[Any](default="detector", description="what looks")
    own_camera = Input(str, default="camera/image", description="the topic of the robot's own pictures")
    other_camera = Input(str, default="corner_camera/image", description="the topic of pictures that cost nothing")
    energy_left = Input(float, description="what is left of the budget for pictures, in J")
    darkness = Input(float, description="0 to 1")
    looks_left = Input(int, description="how often the robot is still to look")
    dark_above = Input(float, default=0.70, description="darkness above which one picture is not enough")
    picture_energy = Input(float, default=PICTURE_ENERGY, description="what a picture of the own camera takes, in J")

    def plan(self) -> list[DesiredChange]:
        """Return the camera, and how many pictures to take."""
        return self.looking(*self.choice())

    def choice(self) -> tuple[str, int]:
        """Return the camera's topic, and how many pictures to take."""
        reserve = (max(0, self.looks_left) + SPARE_PICTURES) * self.picture_energy
        left, is_dark = self.energy_left, self.darkness > self.dark_above
        if left <= 0.0 or (is_dark and left < reserve):
            return self.other_camera, 1
        return self.own_camera, PICTURES_IN_THE_DARK if is_dark else 1

    def looking(self, topic: str, pictures: int, **others: float) -> list[DesiredChange]:
        """Return the changes to the detector."""
        detector = str(self.read_port("subject_location"))
        return [Connect(detector, "image", topic), SetParameters(detector, {"pictures": pictures, **others})]


class AdjustDetectionPauses(AdjustDetectionAttempts):
    """The same with what other strategies may use, too: pauses, and a monitor of the other camera's pictures.

    The other camera takes over no more while its pictures are faulty. The robot then looks for itself as long as there
    is energy left: by single pictures far apart, as it sees little.
    """

    other_faults = Input(float, description="how many faults there are in the other camera's pictures")
    pause = Input(float, default=1.0, description="the usual time before a picture, in s")
    long_pause = Input(float, default=3.0, description="the time where little is seen, in s")

    def plan(self) -> list[DesiredChange]:
        """Return the camera, how many pictures to take, and the time before each."""
        topic, pictures = self.choice()
        if topic == self.other_camera and self.other_faults > 0.0 and self.energy_left >= self.picture_energy:
            return self.looking(self.own_camera, 1, interval=self.long_pause)
        return self.looking(topic, pictures, interval=self.pause)


PLANS = [AdjustMaxVelocity, AdjustMaxVelocityAmong, AdjustDetectionAttempts, AdjustDetectionPauses]
