"""ReBeT's plans and accounts as they were published, faults included: for comparison, not for use.

They follow the code of the published experiment (E. G. Alberts et al., "ReBeT", ACSOS 2024, replication package).
`regraft.stacks.frog.plans` and `regraft.stacks.frog.quality` are what FROG really uses.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from behavior_tree import SUCCESS, Input, NodeSetup, PortError, Status
from regraft.bus_schema.model.adaptation import Change
from regraft.services.bt_executor.adaptation import (
    AdaptOnStart,
    AdaptPeriodically,
    Connect,
    DesiredChange,
    SetParameters,
    Step,
)
from regraft.services.bt_executor.adaptation.results import Result
from regraft.services.bt_executor.quality import QualityTeller, TaskLevelQR
from regraft.services.power_model import PICTURE_ENERGY
from regraft.stacks.frog.plans import PICTURES_IN_THE_DARK, SLOWEST, SPARE_PICTURES, STEP
from regraft.stacks.frog.quality import POWER, DetectPowerEfficiently
from regraft.stacks.frog.utility import FASTEST

NOT_MEASURED = -10.0
"""The prefix of every metric; decisions are made on these."""
SAMPLE_INTERVAL = 2.0
"""s between two looks at the power: the published leg "power" is a sum of such samples, half the energy in J."""
EVER_LOOKS = 4 * 5
"""Looks that the plan reckons with, however long the mission continues."""


class PublishedMaxVelocity(AdaptPeriodically):
    """Slower near obstacles or when the last leg cost much, else faster: first slower, as nothing is measured yet."""

    subject_location = Input[Any](default="navigator", description="what drives")
    adaptation_subject = Input[Any](default="max_velocity", description="its parameter, in m/s")
    adaptation_period = Input[Any](default="3s", description="the interval")
    safety = Input(float, description="distance to the nearest obstacle as a share of the range, 0 to 1")
    quickness = Input(float, description="speed as a share of the greatest, 0 to 1")
    leg_power = Input(float, description="sum of the samples of power of the leg before, in W")

    def __init__(self, setup: NodeSetup, context: Any) -> None:
        super().__init__(setup, context)
        self._known = {"safety": NOT_MEASURED, "quickness": NOT_MEASURED, "leg_power": NOT_MEASURED}
        self._decided = False

    def plan(self) -> Step | None:
        """Return a step down or up; what is not known now counts as it was last known."""
        for name in self._known if self._decided else ():
            with suppress(PortError):
                self._known[name] = float(self.read_port(name))
        safety, quickness, power = self._known.values()
        if safety < 0.10 or power > 40.0:
            return Step(*self.target(), -STEP, SLOWEST, FASTEST)
        if power < 39.0 or safety > 0.15 or quickness < 0.40:
            return Step(*self.target(), STEP, SLOWEST, FASTEST)
        return None

    def adapted(self, result: Result) -> None:
        """Look at what is measured from now on."""
        self._decided = True


class PublishedMovePower(TaskLevelQR):
    """The published account of a drive: a sample of power every 2 s, their sum reported when the drive has
    succeeded.
    """

    attribute = POWER
    higher_is_better = False

    motion_power = Input(float, description="power that the drive takes, in W")

    def __init__(self, setup: NodeSetup, context: QualityTeller) -> None:
        super().__init__(setup, context)
        self._sum = 0.0
        self._next = 0.0
        self._told = NOT_MEASURED

    def measure(self) -> float | None:
        """Take a sample if it is time; returns the sum of the drive before."""
        if self.now() >= self._next:
            self._next = self.now() + SAMPLE_INTERVAL
            self._sum += self.motion_power
        return self._told

    def on_end(self, status: Status) -> float | None:
        """Report the sum of a drive that has succeeded."""
        if status == SUCCESS:
            self._told, self._sum = self._sum, 0.0
        return self._told


class PublishedDetectPower(DetectPowerEfficiently):
    """The published account of pictures: a call for n takes n times too much, whichever camera they come from."""

    def paid_pictures(self) -> int:
        """Return the square of how many were paid for."""
        return self.paid**2


class PublishedPictures(AdaptOnStart):
    """Three pictures in the dark as long as the account allows, else the camera in the corner; one change a call."""

    subject_location = Input[Any](default="detector", description="what looks")
    energy_left = Input(float, description="what is left of the budget by the published account, in J")
    darkness = Input(float, description="0 to 1")

    def __init__(self, setup: NodeSetup, context: Any) -> None:
        super().__init__(setup, context)
        self._is_external = False
        self._pictures = 1
        self._calls = 0

    def on_started(self) -> None:
        """Count the calls."""
        super().on_started()
        self._calls += 1

    def plan(self) -> DesiredChange | None:
        """Return the one change, if there is one."""
        needed = (EVER_LOOKS - self._calls + 1 + SPARE_PICTURES) * PICTURE_ENERGY
        left, is_dark = self.energy_left, self.darkness > 0.70
        if left < 0.0 or (is_dark and not (left >= needed and left > 0.0)):
            return None if self._is_external else Connect(self._detector, "image", "corner_camera/image")
        if self._is_external:
            return Connect(self._detector, "image", "camera/image")
        wanted = PICTURES_IN_THE_DARK if is_dark else 1
        return None if wanted == self._pictures else SetParameters(self._detector, {"pictures": wanted})

    def adapted(self, result: Result) -> None:
        """Remember what was changed."""
        changes: tuple[Change, ...] = result.report.request.changes if result.report else ()
        for change in changes:
            if isinstance(change, Connect):
                self._is_external = change.topic != "camera/image"
            elif isinstance(change, SetParameters):
                self._pictures = int(change.parameters["pictures"])

    @property
    def _detector(self) -> str:
        return str(self.read_port("subject_location"))


NODES = [PublishedMaxVelocity, PublishedMovePower, PublishedDetectPower, PublishedPictures]
