"""The condition of one observed component over time: normal, failed, recovered (MROS, section II-A)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from regraft.bus_schema.annotations import PlainValue


class ComponentStatus(StrEnum):
    """The reported status of a component, in MROS's words; ``UNKNOWN`` is not reported."""

    UNKNOWN = ""
    NORMAL = "TRUE"
    FAILED = "FALSE"
    RECOVERED = "RECOVERED"


@dataclass(frozen=True, slots=True)
class Evidence:
    """Whether a component has failed, and why; None is not known. ``by_itself``: it reports its failure, and lives.

    The ``stamp`` is that of the failure's report, None where it is not known.
    """

    failed: bool | None
    why: str = ""
    by_itself: bool = False
    stamp: float | None = None


UNKNOWN = Evidence(None)


@dataclass(frozen=True, slots=True)
class Delays:
    """Seconds: how long evidence has to last before the status changes, and how long what has failed rests.

    ``presumed_after`` is the time without activity after which a failure is presumed to be over; 0: never. That holds
    for failures of sensors, and for those that components report of themselves.
    """

    failed_after: float
    recovered_after: float
    sensor_grace: float
    presumed_after: float


class Condition:
    """The condition of one component, by the evidence so far."""

    def __init__(self, remembered: PlainValue = None) -> None:
        """Begin as unknown, or as an earlier run of the observer has ``remembered`` it."""
        known = remembered if isinstance(remembered, dict) else {}
        self.status = ComponentStatus(known.get("status", ""))
        self.why: str = known.get("why", "")
        self._sensor: str = known.get("sensor", "")
        self._has_evidence = False
        self._differs_since: float | None = None
        self._active_since: float | None = None
        self._idle_since: float | None = None
        self._idle_before: float = known.get("idle", 0.0)
        self._seen_at = 0.0
        self._failure: float | None = known.get("failure")

    @property
    def is_certain(self) -> bool:
        """Whether the latest evidence agrees with the status; what was remembered is not certain without any."""
        return self._has_evidence and self.status is not ComponentStatus.UNKNOWN and self._differs_since is None

    def remembered(self) -> PlainValue:
        """Return what a further run of the observer continues with."""
        known = {"status": self.status.value, "why": self.why, "sensor": self._sensor}
        idle = self._idle_before if self._idle_since is None else self._seen_at - self._idle_since
        return {**known, "failure": self._failure, "idle": idle}

    def see(self, now: float, is_active: bool, life: Evidence, sensor: Evidence, delays: Delays) -> bool:
        """Take evidence in, at a time in seconds; return whether the status has changed.

        ``life`` is that of the lifecycle and the process. ``sensor`` counts only while the component is active: one
        that an adaptation has deactivated is silent, and not failed.
        """
        self._seen_at = now
        self._see_sensor(now, is_active, sensor, delays)
        if life.by_itself:
            self._see_failure(now, is_active, life)
        if life.failed and life.by_itself and self._is_presumed_well(now, delays):
            life = Evidence(False)
        if self._sensor and not life.failed:
            life = Evidence(True, self._sensor)
        self._has_evidence = self._has_evidence or life.failed is not None
        if life.failed is False and self.status is ComponentStatus.UNKNOWN:
            self.status = ComponentStatus.NORMAL
            return True
        if life.failed is None or life.failed == (self.status is ComponentStatus.FAILED):
            self._differs_since = None
            return False
        if self._differs_since is None:
            self._differs_since = now
        if now - self._differs_since < (delays.failed_after if life.failed else delays.recovered_after):
            return False
        self._differs_since = None
        self.status = ComponentStatus.FAILED if life.failed else ComponentStatus.RECOVERED
        self.why = life.why
        return True

    def _see_sensor(self, now: float, is_active: bool, sensor: Evidence, delays: Delays) -> None:
        if is_active:
            self._idle_since, self._idle_before = None, 0.0
            if self._active_since is None:
                self._active_since = now
            # Silence from before the activation is no failure: what watches the sensor needs time to hear it.
            if sensor.failed is False or (sensor.failed and now - self._active_since >= delays.sensor_grace):
                self._sensor = sensor.why if sensor.failed else ""
            return
        self._active_since = None
        if self._idle_since is None:
            self._idle_since = now - self._idle_before
        if self._is_presumed_well(now, delays):
            self._sensor = ""

    def _see_failure(self, now: float, is_active: bool, life: Evidence) -> None:
        if life.stamp is None or life.stamp == self._failure:
            return
        self._failure = life.stamp
        # It was tried, though it may never have been seen active: so its inactive time begins again.
        if not is_active:
            self._idle_since = now

    def _is_presumed_well(self, now: float, delays: Delays) -> bool:
        """Return whether it has been inactive without a new failure for so long that it is worth another try."""
        idle = 0.0 if self._idle_since is None else now - self._idle_since
        return delays.presumed_after > 0.0 and idle >= delays.presumed_after
