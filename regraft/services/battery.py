"""The robot's battery: what is left in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft import Component, Input, Output, Parameter, Quality, Records, every
from regraft.bus_schema.annotations import Bounds, PlainValue, Seconds, Unit
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.messages.power import BatteryState, ChargerState, EnergyUse, PowerDraw
from regraft.bus_schema.messages.sensors import Odometry
from regraft.bus_schema.model.description import Resources
from regraft.services import robot_parameters
from regraft.services.power_model import motion_power, total_power

EMPTY, LOW, BELOW_LIMIT, FULL = "empty", "low", "below_limit", "ok"
SEVERITY = {EMPTY: Level.ERROR, LOW: Level.WARNING, BELOW_LIMIT: Level.WARNING, FULL: Level.OK}
TEXTS = {EMPTY: "empty", LOW: "low", BELOW_LIMIT: "below its limit", FULL: "all right"}
DRAIN = "drain"
"""The consumer that a fault is."""
CHARGER_HOLDS = 2.0
"""s: for this long after its last message, a charger is taken to give the power that it reported."""


@dataclass(frozen=True, slots=True)
class Drain:
    """From ``at`` on, a fault draws this power."""

    at: Annotated[Seconds, Bounds(minimum=0.0)]
    power: Annotated[float, Unit("W"), Bounds(minimum=0.0)]


class Battery(Component):
    """Keeps account of the energy: integrates what motion and constant consumers draw, books single uses, and charges.

    The robot's speed is taken from every odometry message since the last account, and holds until the next; so
    does what the charger gives. Below its ``limit`` the battery asks to be charged, until it is ``recharged``.
    An empty battery gives nothing: what is drawn from it is neither booked nor delivered.
    """

    state_version = 2
    checkpoint_every = 1.0
    resources = Resources(cpu=0.02, memory=20.0)

    capacity = Parameter(20_000.0, "energy of the full battery", minimum=1.0, unit="J", read_only=True)
    initial_charge = Parameter(1.0, "how full it is at the start", minimum=0.0, maximum=1.0, read_only=True)
    limit = Parameter(0.9, "charge that is wanted at all times; 0: none", minimum=0.0, maximum=1.0)
    recharged = Parameter(0.98, "charge at which one below the limit is all right again", minimum=0.0, maximum=1.0)
    low = Parameter(0.2, "charge below which it is called low", minimum=0.0, maximum=1.0)

    drain = Parameter(0.0, "what a fault draws, besides that of 'drains'", minimum=0.0, unit="W")
    drains = Records(Drain, "when a fault draws how much", in_order_of="at")

    motion_power = robot_parameters.motion_power()
    consumers = robot_parameters.consumers()

    odometry = Input(Odometry, keep=4096, description="how fast the robot drives")
    energy = Input(EnergyUse, keep=4096, required=False, description="what is taken at once, as for a picture")
    charger = Input(ChargerState, keep=256, required=False, description="what is put in, if there is a charger")
    drawn_power = Quality("of the whole robot", unit="W", better="lower", minimum=0.0, name="power")
    load = Quality(
        "of the robot's parts, without what faults drain", unit="W", better="lower", minimum=0.0, estimated=False
    )
    endurance = Quality("until it is empty", unit="s", better="higher", minimum=0.0, functional=True)
    time_to_limit = Quality("until the wanted charge is reached", unit="s", better="higher", minimum=0.0)
    charge = Quality("how full it is", better="higher", minimum=0.0, maximum=1.0, functional=True, estimated=False)
    drawn = Quality("energy since the start", unit="J", better="lower", minimum=0.0, estimated=False)
    charged = Quality("energy since the start", unit="J", minimum=0.0, estimated=False)

    battery = Output(BatteryState, description="what is left")
    power = Output(PowerDraw, description="what each part draws, as the mean since the last message")

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the ``power`` (W) of the whole robot, the ``endurance`` (s), and the ``time_to_limit`` (s).

        ``context`` may give the ``charge``, and the ``power`` that is drawn or the ``speed`` (m/s) that gives it,
        without pictures. All times are without a charger.
        """
        capacity = float(parameters.get("capacity", cls.capacity.default))
        limit = float(parameters.get("limit", cls.limit.default))
        initial = float(parameters.get("initial_charge", cls.initial_charge.default))
        charge = float(context.get("charge", initial))
        powers = parameters.get("motion_power", cls.motion_power.default)
        consumers = cls.consumers.checked(parameters.get("consumers", cls.consumers.default))
        power = float(context.get("power", total_power(float(context.get("speed", 0.0)), powers, consumers)))
        return {"power": power} | cls._times(charge, limit, capacity, power)

    @staticmethod
    def _times(charge: float, limit: float, capacity: float, power: float) -> dict[str, float]:
        """Return how long (s) a power (W) can be drawn, and how long until the limit; nothing if none is drawn."""
        if power <= 0.0:
            return {}
        until_limit = max(0.0, charge - limit) * capacity / power
        return {"endurance": charge * capacity / power, "time_to_limit": until_limit}

    def on_configure(self) -> None:
        """Begin with the initial charge."""
        self._left = self.capacity * self.initial_charge
        self._until: float | None = None
        self._speed = 0.0
        self._level = FULL
        self._drawn = self._charged = self._power = self._load = 0.0
        self._charger = ChargerState(0.0, False, 0.0)
        self._charging = False

    def on_activate(self) -> None:
        """Begin to draw now, or from where a restored account ends."""
        if self._until is None:
            self._until = self.kit.now()

    def on_deactivate(self) -> None:
        """Draw nothing from now on."""
        self._until = None

    @every(hz=2.0)
    def account(self) -> None:
        """Book what was drawn and charged since the last time, and publish the state."""
        now = self.kit.now()
        since = now if self._until is None else self._until
        spent = {"motion": self._motion_energy(since, now)}
        for consumer in self.consumers:
            spent[consumer.name] = spent.get(consumer.name, 0.0) + consumer.power * (now - since)
        lost = self._drained(now)
        if lost > 0.0:
            spent[DRAIN] = spent.get(DRAIN, 0.0) + lost * (now - since)
        for use in self.energy.take():
            spent[use.consumer] = spent.get(use.consumer, 0.0) + use.energy
        self._until = now
        self._book(sum(spent.values()), self._charger_energy(since, now))
        self._tell(now, spent, now - since)

    def _book(self, wanted: float, offered: float) -> None:
        """Give what is wanted (J) while there is any, and take in what is offered (J) while there is room."""
        drawn = min(wanted, self._left + offered)
        charged = min(offered, self.capacity - self._left + drawn)
        self._drawn += drawn
        self._charged += charged
        self._left = min(max(self._left + charged - drawn, 0.0), self.capacity)

    def _drained(self, now: float) -> float:
        """Return the power (W) that faults draw at a time (s)."""
        scheduled = [drain.power for drain in self.drains if drain.at <= now]
        return self.drain + (scheduled[-1] if scheduled else 0.0)

    def _motion_energy(self, since: float, now: float) -> float:
        """Return the energy (J) of the drive between two times (s), the speed being piecewise constant."""
        energy, time = 0.0, since
        for odometry in self.odometry.take():
            then = min(max(odometry.stamp, time), now)
            energy += self._motion_power() * (then - time)
            time, self._speed = then, odometry.twist.forward
        return energy + self._motion_power() * (now - time)

    def _motion_power(self) -> float:
        return motion_power(self._speed, self.motion_power)

    def _charger_energy(self, since: float, now: float) -> float:
        """Return the energy (J) that the charger offers between two times (s), its power being piecewise constant."""
        energy, time = 0.0, since
        for charger in self.charger.take():
            then = min(max(charger.stamp, time), now)
            energy += self._offered(time, then)
            time, self._charger = then, charger
        return energy + self._offered(time, now)

    def _offered(self, since: float, until: float) -> float:
        seconds = min(until, self._charger.stamp + CHARGER_HOLDS) - since
        return self._charger.power * max(seconds, 0.0) if self._charger.connected else 0.0

    def _tell(self, now: float, spent: dict[str, float], seconds: float) -> None:
        draw = {consumer: energy / seconds for consumer, energy in spent.items()} if seconds > 0.0 else {}
        charge = self._left / self.capacity
        total = self._power = sum(draw.values())
        self._load = total - draw.get(DRAIN, 0.0)
        self.battery.publish(BatteryState(now, self._left, self.capacity, min(charge, 1.0), total))
        self.power.publish(PowerDraw(now, total, draw))
        level = self._level_at(charge)
        if level != self._level:
            self._level = level
            self._report(level, charge)
        gives = self._charger.connected and self._charger.power > 0.0
        charging = gives and now - self._charger.stamp <= CHARGER_HOLDS
        if charging != self._charging:
            self._charging = charging
            text = f"charging with {self._charger.power:g} W" if charging else "not charging any more"
            self.kit.diagnose("charging", Level.OK, text, charge=charge)
            self.kit.event("battery.charging" if charging else "battery.unplugged", text, charge=charge)

    def _level_at(self, charge: float) -> str:
        if self._left <= 0.0:
            return EMPTY
        if charge < self.low:
            return LOW
        # Once below the limit it asks to be charged until it is full again, not just back above the limit.
        asks = charge < self.limit or (self._level != FULL and charge < min(self.recharged, 1.0) and self.limit > 0.0)
        return BELOW_LIMIT if asks else FULL

    def _report(self, level: str, charge: float) -> None:
        text = f"the battery is {TEXTS[level]}: {charge:.0%} of {self.capacity:.0f} J are left"
        self.kit.diagnose("battery", SEVERITY[level], text, charge=charge)
        self.kit.event(f"battery.{level}", text, charge=charge)

    def evaluate(self) -> dict[str, float]:
        """Return the charge, the energy (J) drawn and charged since the start, and what is drawn now.

        ``power`` (W) is that of the last half second; ``endurance`` and ``time_to_limit`` (s) are as long as it holds.
        """
        charge = self._left / self.capacity
        now = {"power": self._power, "load": self._load} | self._times(charge, self.limit, self.capacity, self._power)
        return {"charge": charge, "drawn": self._drawn, "charged": self._charged} | now

    def snapshot(self) -> PlainValue:
        """Return the account."""
        charger = self._charger
        return {
            "left": self._left,
            "speed": self._speed,
            "level": self._level,
            "until": self._until,
            "drawn": self._drawn,
            "charged": self._charged,
            "charger": [charger.stamp, charger.connected, charger.power],
            "charging": self._charging,
        }

    def restore(self, state: PlainValue) -> None:
        """Continue an account; the time since then is drawn at the last known speed."""
        self._left, self._speed, self._level = min(state["left"], self.capacity), state["speed"], state["level"]
        self._until = state["until"]
        self._drawn, self._charged = state["drawn"], state["charged"]
        self._charger = ChargerState(*state["charger"])
        self._charging = state.get("charging", False)  # an earlier release has not kept it
