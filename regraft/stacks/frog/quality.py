"""FROG's quality requirements (E. G. Alberts et al., "ReBeT", ACSOS 2024, section IV), each defined once, here.

The executor finds them by its parameter ``nodes: regraft.stacks.frog.quality:REQUIREMENTS``; a mission then has, for
instance,

    <MoveSafely nearest="{@nearest}" speed="{@speed}" stale_after="1" metric="{@safety}"> … </MoveSafely>

Data come from the root blackboard. Powers are in W and energies in J: the paper's "Watts" are sums of power samples,
energies in an unknown unit; here they are integrals over time. All constants are ports, with the paper's values.
"""

from __future__ import annotations

import math
from collections import Counter

from behavior_tree import Input, NodeSetup, Output, Status
from regraft.services.bt_executor.quality import (
    Integral,
    QualityTeller,
    SystemLevelQR,
    TaskLevelQR,
    Unknown,
    Writes,
    at_least,
    at_most,
    close_to,
)
from regraft.services.navigator.qualities import is_safe, near_of
from regraft.services.power_model import IDLE_POWER, LIDAR_POWER, PICTURE_ENERGY
from regraft.stacks.frog.utility import BUDGET, within_budget

SAFETY, MOVEMENT_EFFICIENCY, TASK_EFFICIENCY, POWER = "Safety", "MovementEfficiency", "TaskEfficiency", "Power"


class MoveSafely(TaskLevelQR):
    """B1-1: drives slower than 0.18 m/s while something is within the first tenth of the lidar's range.

    Satisfied while nothing is nearer, or the robot is slower, by what is measured at that moment: the analysis and the
    rewards go by the same function. The metric is the distance to the nearest obstacle as a share of the lidar's range,
    in [0, 1].
    """

    attribute = SAFETY

    nearest = Input(float, description="distance to the nearest obstacle, in m; the farthest range if there is none")
    speed = Input(float, description="the robot's speed, in m/s")
    near = Input(float, default=0.10, description="share of the range within which an obstacle is near")
    slow = Input(float, default=0.18, description="speed in m/s below which the robot is slow")
    range_min = Input(float, default=0.12, description="the lidar's shortest range, in m")
    range_max = Input(float, default=3.5, description="the lidar's farthest range, in m")

    def measure(self) -> float | None:
        """Return the distance to the nearest obstacle as a share of the range."""
        share = (self.nearest - self.range_min) / (self.range_max - self.range_min)
        return min(max(share, 0.0), 1.0)

    def is_satisfied(self, metric: float) -> bool:
        """Return whether nothing is near, or the robot slow."""
        return is_safe(self.nearest, self.speed, near_of(self.range_min, self.range_max, self.near), self.slow)


class MoveQuickly(TaskLevelQR):
    """B1-2: drives as close to its maximum velocity as possible; the metric is the share of it, in [0, 1].

    A robot that stands or turns on the spot does not drive: then nothing is measured.
    """

    attribute = MOVEMENT_EFFICIENCY

    speed = Input(float, description="the robot's speed, in m/s")
    max_speed = Input(float, default=0.26, description="the speed to be as close to as possible, in m/s")
    within = Input(float, default=0.08, description="how far from it is still good enough, in m/s")
    moving_from = Input(float, default=0.03, description="the speed from which on the robot drives, in m/s")

    def measure(self) -> float | None:
        """Return the speed as a share of the maximum velocity."""
        speed = abs(self.speed)
        if speed <= self.moving_from:
            raise Unknown("the robot does not drive")
        return min(speed / self.max_speed, 1.0)

    def degree_of(self, metric: float) -> float:
        """Return 1 at the maximum velocity, one half where it is just good enough."""
        return close_to(metric * self.max_speed, self.max_speed, self.within)


class MovePowerEfficiently(TaskLevelQR):
    """B1-3: takes as little energy as possible to drive somewhere; the metric is that energy, in J.

    It is the integral of the drive's power since the task began, reported again when the task is done.
    """

    attribute = POWER
    higher_is_better = False

    motion_power = Input(float, description="power that the drive takes, in W")
    acceptable = Input(float, default=80.0, description="energy in J that will just do")

    def __init__(self, setup: NodeSetup, context: QualityTeller) -> None:
        super().__init__(setup, context)
        self._energy = Integral(0.0)

    def on_start(self) -> None:
        """Begin to add up."""
        self._energy = Integral(self.now(), self.stale_after or math.inf)

    def measure(self) -> float | None:
        """Return the energy so far."""
        return self._energy.add(self.motion_power, self.now())

    def on_end(self, status: Status) -> float | None:
        """Return the energy of the whole task."""
        return self.measure()

    def degree_of(self, metric: float) -> float:
        """Return 1 for no energy, one half for what will just do."""
        return at_most(metric, self.acceptable, within=self.acceptable)


class HitCounting(TaskLevelQR):
    """The base of what counts pictures and hits since the mission was loaded: each call once, when it is answered."""

    attribute = TASK_EFFICIENCY

    hits = Input(int, description="in how many pictures of the last call the object was seen")
    looked = Input(int, description="how many pictures of the last call were looked at")

    def __init__(self, setup: NodeSetup, context: QualityTeller) -> None:
        super().__init__(setup, context)
        self._answers: Writes | None = None
        self._is_answered = False
        self.hits_so_far = self.pictures_so_far = 0

    def on_start(self) -> None:
        """Wait for the next answer."""
        self._answers = Writes(self, "hits")

    def counts(self) -> bool:
        """Return whether the last answer is one to count."""
        return True

    def count(self) -> None:
        """Count an answer that is new, once all of it can be read."""
        if self._answers is not None and self._answers.are_new():
            self._is_answered = True
        if self._is_answered:
            hits, looked, counts = self.hits, self.looked, self.counts()
            self._is_answered = False
            if counts:
                self.hits_so_far += hits
                self.pictures_so_far += looked

    def on_end(self, status: Status) -> float | None:
        """Count the answer with which the task ended."""
        return self.measure()


class DetectEffectively(HitCounting):
    """B1-5: sees the object as often as possible; the metric is the share of the pictures in which it was seen."""

    acceptable = Input(float, default=0.5, description="the share that will just do")

    def measure(self) -> float | None:
        """Return the share so far, None before the first picture."""
        self.count()
        return self.hits_so_far / self.pictures_so_far if self.pictures_so_far else None

    def degree_of(self, metric: float) -> float:
        """Return 1 from twice the share that will just do on."""
        return at_least(metric, self.acceptable, within=self.acceptable)


class CameraHitRate(HitCounting):
    """Learns how often one camera sees the object, or any if none is named, and requires nothing.

    The metric is (hits + 1) / (pictures + 2) of that camera, by Laplace's rule: one half before its first picture.
    """

    image_topic = Input(str, description="the topic that the last pictures came from")
    camera = Input(str, default="corner_camera/image", description="the topic of its pictures; empty: any")

    def data_ports(self) -> tuple[str, ...]:
        """Return none: before the first picture the rate is known to be one half."""
        return ()

    def counts(self) -> bool:
        """Return whether the pictures are the camera's."""
        return self.camera in ("", self.image_topic)

    def measure(self) -> float | None:
        """Return the rate so far."""
        self.count()
        return (self.hits_so_far + 1) / (self.pictures_so_far + 2)


class DetectPowerEfficiently(TaskLevelQR):
    """B1-4: looks for objects without taking more energy than the budget; the metric is what it has taken, in J.

    The detector reports which of its pictures have taken energy, and how much. They are counted since the mission was
    loaded, each call of the detector once, when its answer is in.
    """

    attribute = POWER
    higher_is_better = False

    paid = Input(int, description="how many pictures of the last call have taken the robot's energy")
    picture_energy = Input(float, default=PICTURE_ENERGY, description="what each has taken, in J, if that is reported")
    budget = Input(float, default=BUDGET, description="what all may take, in J")
    energy_left = Output(float, description="what is left of the budget, in J; less than 0 if it was overdrawn")

    def __init__(self, setup: NodeSetup, context: QualityTeller) -> None:
        super().__init__(setup, context)
        self._answers: Writes | None = None
        self._paid: Counter[float] = Counter()

    def data_ports(self) -> tuple[str, ...]:
        """Return none: before the first picture it is known that nothing has been taken."""
        return ()

    def on_start(self) -> None:
        """Wait for the next answer, and report what is left for it."""
        self._answers = Writes(self, "paid")
        self._tell_left()

    def measure(self) -> float | None:
        """Return the energy so far."""
        if self._answers is not None and self._answers.are_new():
            self._paid[self.read_port_or("picture_energy", PICTURE_ENERGY)] += self.paid_pictures()
        self._tell_left()
        return self._taken()

    def paid_pictures(self) -> int:
        """Return for how many pictures of the last answer the robot has paid."""
        return self.paid

    def _taken(self) -> float:
        """Return what was taken: by products, as the sum of 120 pictures' energies comes out above a budget for 120."""
        return float(sum(pictures * energy for energy, pictures in self._paid.items()))

    def _tell_left(self) -> None:
        if "energy_left" in self.setup.writers:
            self.energy_left = self.budget - self._taken()

    def on_end(self, status: Status) -> float | None:
        """Count the answer with which the task ended."""
        return self.measure()

    def is_satisfied(self, metric: float) -> bool:
        """Return whether it is within the budget."""
        return within_budget(metric, self.budget)


class MinBatteryNavigation(TaskLevelQR):
    """A1.1: the battery keeps above 90 % while the robot drives; the metric is the power that driving takes, in W."""

    attribute = POWER
    higher_is_better = False

    battery_charge = Input(float, description="how full the battery is, in [0, 1]")
    motion_power = Input(float, description="power that the drive takes, in W")
    least = Input(float, default=0.90, description="the least charge that will do")

    def measure(self) -> float | None:
        """Return the drive's power."""
        return self.motion_power

    def is_satisfied(self, metric: float) -> bool:
        """Return whether the battery is full enough."""
        return self.battery_charge >= self.least


class MinBatterySystem(SystemLevelQR):
    """A1: the battery keeps above 90 % during operation; the metric is its charge, in [0, 1].

    Its ``power`` is what the whole robot draws: what `MinBatteryNavigation` measures below, the lidar, and what is
    always on.
    """

    attribute = POWER

    battery_charge = Input(float, description="how full the battery is, in [0, 1]")
    least = Input(float, default=0.90, description="the least charge that will do")
    lidar_power = Input(float, default=LIDAR_POWER, description="what the lidar draws, in W")
    idle_power = Input(float, default=IDLE_POWER, description="what is always drawn, in W")
    satisfied_status = Input(str, default="OK", description="out_status while it is satisfied")
    violated_status = Input(str, default="below_min", description="out_status while it is not")
    power = Output(float, description="what the robot draws, in W; not written while that is unknown")

    def measure(self) -> float | None:
        """Return the charge."""
        driving = [
            task.verdict.metric.value
            for task in self.gathered().values()
            if task.type_id == MinBatteryNavigation.__name__
        ]
        known = [power for power in driving if power is not None]
        if "power" in self.setup.writers and len(known) == len(driving):
            self.power = sum(known) + self.lidar_power + self.idle_power
        return self.battery_charge

    def on_end(self, status: Status) -> float | None:
        """Return the charge at the end."""
        return self.measure()

    def is_satisfied(self, metric: float) -> bool:
        """Return whether the battery is full enough."""
        return metric >= self.least


REQUIREMENTS = [
    MoveSafely,
    MoveQuickly,
    MovePowerEfficiently,
    DetectEffectively,
    CameraHitRate,
    DetectPowerEfficiently,
    MinBatteryNavigation,
    MinBatterySystem,
]
