"""The robot's battery: what is left in it."""

from __future__ import annotations

from bus_schema.annotations import PlainValue
from bus_schema.messages.health import Level
from bus_schema.messages.power import BatteryState, EnergyUse, PowerDraw
from bus_schema.messages.sensors import Odometry
from regraft import Component, Input, Output, Parameter, every
from services.power_model import IDLE_POWER, LIDAR_POWER, motion_power

EMPTY, LOW, FULL = "empty", "low", "ok"


class Battery(Component):
    """Keeps account of the energy: integrates what motion, lidar and the rest draw, and books single uses.

    The robot's speed is taken from every odometry message since the last account, and holds until the next.
    """

    state_version = 1
    checkpoint_every = 1.0

    capacity = Parameter(20_000.0, "energy of the full battery", minimum=1.0, unit="J", read_only=True)
    initial_charge = Parameter(1.0, "how full it is at the start", minimum=0.0, maximum=1.0, read_only=True)
    low = Parameter(0.2, "charge below which it is called low", minimum=0.0, maximum=1.0)

    odometry = Input(Odometry, keep=4096, text="how fast the robot drives")
    energy = Input(EnergyUse, keep=4096, required=False, text="what is taken at once, as for a picture")
    battery = Output(BatteryState, text="what is left")
    power = Output(PowerDraw, text="what each part draws, as the mean since the last message")

    def on_configure(self) -> None:
        """Begin with the initial charge."""
        self._left = self.capacity * self.initial_charge
        self._until: float | None = None
        self._speed = 0.0
        self._level = FULL

    def on_activate(self) -> None:
        """Begin to draw now: nothing was drawn while this was inactive."""
        self._until = self.kit.now()

    @every(hz=2.0)
    def account(self) -> None:
        """Book what was drawn since the last time, and tell."""
        now = self.kit.now()
        since = now if self._until is None else self._until
        spent = {
            "motion": self._motion_energy(since, now),
            "lidar": LIDAR_POWER * (now - since),
            "idle": IDLE_POWER * (now - since),
        }
        for use in self.energy.take():
            spent[use.consumer] = spent.get(use.consumer, 0.0) + use.energy
        self._until = now
        self._left = max(0.0, self._left - sum(spent.values()))
        self._tell(now, spent, now - since)

    def _motion_energy(self, since: float, now: float) -> float:
        """Return the energy (J) of the drive between two times (s), the speed being piecewise constant."""
        energy, time = 0.0, since
        for odometry in self.odometry.take():
            then = min(max(odometry.stamp, time), now)
            energy += motion_power(self._speed) * (then - time)
            time, self._speed = then, odometry.twist.forward
        return energy + motion_power(self._speed) * (now - time)

    def _tell(self, now: float, spent: dict[str, float], seconds: float) -> None:
        draw = {consumer: energy / seconds for consumer, energy in spent.items()} if seconds > 0.0 else {}
        charge = self._left / self.capacity
        total = sum(draw.values())
        self.battery.publish(BatteryState(now, self._left, self.capacity, min(charge, 1.0), total))
        self.power.publish(PowerDraw(now, total, draw))
        level = EMPTY if self._left == 0.0 else LOW if charge < self.low else FULL
        if level != self._level:
            self._level = level
            self._report(level, charge)

    def _report(self, level: str, charge: float) -> None:
        severity = {EMPTY: Level.ERROR, LOW: Level.WARNING, FULL: Level.OK}[level]
        text = f"the battery is {level}: {charge:.0%} of {self.capacity:.0f} J are left"
        self.kit.diagnose("battery", severity, text, charge=charge)
        self.kit.event(f"battery.{level}", text, charge=charge)

    def evaluate(self) -> dict[str, float]:
        """Return the charge."""
        return {"charge": self._left / self.capacity}

    def snapshot(self) -> PlainValue:
        """Return the account."""
        return {"left": self._left, "speed": self._speed, "level": self._level, "until": self._until}

    def restore(self, state: PlainValue) -> None:
        """Continue an account; the time since then is drawn at the last known speed."""
        self._left, self._speed, self._level = state["left"], state["speed"], state["level"]
        self._until = state["until"]
