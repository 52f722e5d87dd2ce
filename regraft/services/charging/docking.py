"""Charging: the action ``charge`` as a component."""

from __future__ import annotations

import math

from regraft import CallFailed, Component, Input, Parameter, Quality, RefusalCode, RequestRefused, action
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import FramedPose, Pose
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.power import BatteryState, Charge, Charged, ChargeProgress, ChargerState
from regraft.bus_schema.model.description import Resources
from regraft.services import robot_parameters
from regraft.services.charging.search import places_to_try
from regraft.services.navigator.qualities import drive_energy, drive_time
from regraft.services.power_model import constant_power, total_power

MAP_FRAME = "map"
LOOK_INTERVAL = 0.25
"""s between looks at the charger and the battery."""
FEEDBACK_INTERVAL = 1.0
STALE = 3.0
"""s: an older word of battery or charger counts for nothing."""
FOREVER = 1e6
"""s, for what will not end: a message carries finite numbers."""


class ChargingFailed(Exception):
    """Why the battery could not be charged."""


class Docking(Component):
    """Drives the robot to its dock, checks its place there, and stays until the battery is full enough.

    It drives with the action ``navigate_to``. A robot that is mistaken about its place may not feel the charger there:
    it then tries around it. A new goal replaces the previous one.
    """

    resources = Resources(cpu=0.01, memory=20.0, devices=("dock",))

    dock_x = Parameter(0.0, "where the dock is in the map", unit="m")
    dock_y = Parameter(0.0, "where the dock is in the map", unit="m")
    dock_yaw = Parameter(0.0, "which way the robot faces on the dock", minimum=-math.pi, maximum=math.pi, unit="rad")
    attempts = Parameter(5, "how often the dock is approached before giving up", minimum=1, maximum=20)
    search = Parameter(
        0.2, "how far from the dock's place it is tried when not felt there", minimum=0.0, maximum=1.0, unit="m"
    )
    felt_within = Parameter(1.5, "how long the charger has to be felt once there", minimum=0.1, maximum=60.0, unit="s")
    ready_within = Parameter(5.0, "how long a goal waits for the battery's first word", minimum=0.0, unit="s")
    patience = Parameter(20.0, "how long the charge may stand still on the dock", minimum=1.0, unit="s")
    expected_power = Parameter(20.0, "what the charger is expected to give", minimum=0.0, unit="W")

    velocity_limit = robot_parameters.velocity_limit()
    motion_power = robot_parameters.motion_power()
    consumers = robot_parameters.consumers()

    docking_time = Quality("of the drive to the dock", unit="s", better="lower", minimum=0.0, measured=False)
    docking_energy = Quality("of the drive to the dock", unit="J", better="lower", minimum=0.0, measured=False)
    net_power = Quality("into the battery of a standing robot", unit="W", better="higher")
    charging_time = Quality("on the dock", unit="s", better="lower", minimum=0.0, functional=True, measured=False)
    docked = Quality("1 on the dock", minimum=0.0, maximum=1.0, functional=True, estimated=False)
    approaches = Quality("of the dock", better="lower", minimum=0.0, estimated=False)

    battery = Input(BatteryState, latest_only=True, description="how full it is")
    charger = Input(ChargerState, latest_only=True, description="whether the robot stands on the dock")

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return what a charging takes, from the goal on.

        ``context`` may give the ``charge`` to begin with, the one to charge ``until``, and the battery's ``capacity``
        (J). It may give the ``power`` (W) that is drawn on the dock.
        It may give the ``distance`` (m) to drive to it (default 0) and the ``speed`` (m/s; above 0, by default that of
        the robot's limit).

        Returns:
            ``docking_time`` (s) and ``docking_energy`` (J) of the drive. ``net_power`` (W) gets into the
            battery of a standing robot. ``charging_time`` (s) on the dock is left out if nothing gets into it.
        """
        power = float(parameters.get("expected_power", cls.expected_power.default))
        powers = parameters.get("motion_power", cls.motion_power.default)
        consumers = cls.consumers.checked(parameters.get("consumers", cls.consumers.default))
        net = power - float(context.get("power", total_power(0.0, powers, consumers)))
        fastest = float(parameters.get("velocity_limit", cls.velocity_limit.default))
        distance, speed = float(context.get("distance", 0.0)), float(context.get("speed", fastest))
        seconds = drive_time(distance, speed)
        spent = drive_energy(distance, speed, powers) + constant_power(consumers) * seconds
        missing = float(context.get("until", Charge().until)) - float(context.get("charge", 0.9))
        energy = max(missing * float(context.get("capacity", 20_000.0)) + spent, 0.0)
        drive = {"docking_time": seconds, "docking_energy": spent, "net_power": net}
        return drive | ({"charging_time": energy / net} if net > 0.0 else {})

    def on_configure(self) -> None:
        """Nothing has been approached yet."""
        self._approaches = 0

    def evaluate(self) -> dict[str, float]:
        """Return whether the robot is on the dock (1 or 0), how often that was approached, and the ``net_power`` (W).

        That is what gets into the battery now; it is reported on the dock only.
        """
        counted = {"docked": float(self._is_connected()), "approaches": float(self._approaches)}
        battery, charger = self.battery.latest, self.charger.latest
        if battery is None or charger is None or not self._is_connected():
            return counted
        return counted | {"net_power": charger.power - battery.power}

    @action("charge", feedback=ChargeProgress)
    async def charge(self, goal: Charge) -> Charged:
        """Stand on the dock until the battery is full enough, and report whether it is."""
        await self._hear_of_the_battery()
        if self._charge() >= goal.until:
            return Charged(True, self._charge())
        try:
            await self._dock_and_fill(goal.until)
        except ChargingFailed as error:
            self.kit.diagnose("charging", Level.ERROR, str(error))
            return Charged(False, self._charge(), str(error))
        self.kit.diagnose("charging", Level.OK, f"charged to {self._charge():.0%}")
        return Charged(True, self._charge())

    async def _hear_of_the_battery(self) -> None:
        deadline = self.kit.now() + self.ready_within
        while not self._is_fresh(self.battery.latest):
            if self.kit.now() >= deadline:
                why = f"cannot charge: no word from the battery within {self.ready_within:g} s"
                raise RequestRefused(why, RefusalCode.UNAVAILABLE)
            await self.kit.sleep(LOOK_INTERVAL)

    async def _dock_and_fill(self, until: float) -> None:
        """Approach the dock until it is felt, and fill the battery; raises ChargingFailed."""
        dock = Pose.planar(self.dock_x, self.dock_y, self.dock_yaw)
        why = ""
        places = places_to_try(dock, self.search)
        for _ in range(self.attempts):
            place = next(places)
            if not self._is_connected():
                phase = "driving" if place == dock else "searching"
                try:
                    await self._approach(place, until, phase)
                except ChargingFailed as error:
                    if phase == "driving":
                        raise
                    # One place around the dock may have no room while the other places have.
                    why = f"; {error}"
                    continue
                if not await self._feels_charger():
                    continue
            if await self._fill(until):
                return
            # It was pushed away: where the dock should be is the best place to begin again.
            places = places_to_try(dock, self.search)
        raise ChargingFailed(f"no charger felt at ({dock.x:g}, {dock.y:g}) in {self.attempts} approaches{why}")

    async def _approach(self, place: Pose, until: float, phase: str) -> None:
        """Drive to a place, or when searching until the charger is felt on the way; raises ChargingFailed."""
        self._approaches += 1
        drive = self.kit.goal(
            "navigate_to",
            NavigateTo(FramedPose(MAP_FRAME, place)),
            Arrival,
            NavigationProgress,
        )
        told = -math.inf
        try:
            while not drive.done:
                if phase == "searching" and self._is_connected():
                    return
                if self.kit.now() - told >= FEEDBACK_INTERVAL:
                    told = self.kit.now()
                    self._tell(phase, self._time_with_drive(until, drive.feedback))
                await self.kit.sleep(LOOK_INTERVAL)
            arrival = await drive.outcome()
        except CallFailed as error:
            raise ChargingFailed(f"cannot drive to the dock: {error}") from None
        finally:
            if not drive.done:
                drive.cancel()
        if not arrival.arrived:
            raise ChargingFailed(f"did not get to the dock: {arrival.reason or 'no reason given'}")

    async def _feels_charger(self) -> bool:
        """Wait for the charger to report that it is connected; raises ChargingFailed if it reports nothing at all."""
        arrived = self.kit.now()
        while self.kit.now() < arrived + self.felt_within:
            await self.kit.sleep(LOOK_INTERVAL)
            charger = self.charger.latest
            if charger is not None and charger.stamp >= arrived and charger.connected:
                return True
        if not self._is_fresh(self.charger.latest):
            raise ChargingFailed(f"at the dock, but no charger has reported within {self.felt_within:g} s")
        return False

    async def _fill(self, until: float) -> bool:
        """Wait until the battery is full enough; returns False if the charger is lost, raises ChargingFailed."""
        told = -math.inf
        best, risen = self._charge(), self.kit.now()
        while True:
            now, battery, charger = self.kit.now(), self.battery.latest, self.charger.latest
            if battery is None or not self._is_fresh(battery):
                raise ChargingFailed(f"no word from the battery for {STALE:g} s while charging")
            if charger is None or not self._is_fresh(charger):
                raise ChargingFailed(f"no word from the charger for {STALE:g} s while charging")
            if battery.charge >= until:
                return True
            if not charger.connected:
                return False
            if battery.charge > best:
                best, risen = battery.charge, now
            if now - risen > self.patience:
                flow = f"the charger gives {charger.power:g} W, {battery.power:.1f} W are drawn"
                raise ChargingFailed(f"the charge has not risen for {self.patience:g} s: {flow}")
            if now - told >= FEEDBACK_INTERVAL:
                told = now
                self._tell("charging", self._time_to_fill(until, charger.power - battery.power))
            await self.kit.sleep(LOOK_INTERVAL)

    def _time_with_drive(self, until: float, progress: NavigationProgress | None) -> float:
        battery = self.battery.latest
        drive = 0.0 if progress is None else progress.time_left
        drawn = 0.0 if battery is None else battery.power * drive
        standing = total_power(0.0, self.motion_power, self.consumers)
        return drive + self._time_to_fill(until, self.expected_power - standing, drawn)

    def _time_to_fill(self, until: float, net_power: float, drawn: float = 0.0) -> float:
        battery = self.battery.latest
        if battery is None or net_power <= 0.0:
            return FOREVER
        return max(until * battery.capacity - battery.energy + drawn, 0.0) / net_power

    def _tell(self, phase: str, time_left: float) -> None:
        self.kit.set_status_text(f"{phase}, {self._charge():.0%}")
        self.kit.feedback(ChargeProgress(self._charge(), phase, min(time_left, FOREVER)))

    def _charge(self) -> float:
        battery = self.battery.latest
        return 0.0 if battery is None else battery.charge

    def _is_fresh(self, message: BatteryState | ChargerState | None) -> bool:
        return message is not None and self.kit.now() - message.stamp <= STALE

    def _is_connected(self) -> bool:
        charger = self.charger.latest
        return charger is not None and self._is_fresh(charger) and charger.connected
