"""Watches what the sensors send, and reports when one of them fails."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from regraft import Component, Input, Output, Parameter, ParameterError, Quality, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.geometry import Twist
from regraft.bus_schema.messages.health import Level, SensorFault, SensorHealth
from regraft.bus_schema.messages.sensors import DepthImage, Image, LaserScan, Odometry
from regraft.bus_schema.model.description import Resources
from regraft.bus_schema.suggestions import no_such
from regraft.services import robot_parameters
from regraft.services.sensor_checks import (
    FROZEN,
    JUMPY,
    SILENT,
    Finding,
    Jumps,
    Sameness,
    is_moving,
    judge_depths,
    judge_picture,
    judge_scan,
    looks_all_around,
    picture_fingerprint,
    scan_fingerprint,
)

SENSORS = ("image", "scan", "odometry", "localization", "depth")
LOOKS = 2.0
"""Hz, of the looks at all sensors."""
COMMAND_HOLDS = 0.5
"""s: so long a robot drives on after a command."""
Message = Image | LaserScan | Odometry | DepthImage


@dataclass(slots=True)
class _Watch:
    """The record of one sensor at one ``topic``, empty for none.

    It begins at ``began`` (s), and again when the port loses its topic or gets another: then ``before`` is what had
    come. ``heard`` is whether a message has come, in this run of the monitor or in an earlier one.
    """

    topic: str
    began: float = -math.inf
    before: Message | None = None
    sameness: Sameness = field(default_factory=Sameness)
    jumps: Jumps = field(default_factory=Jumps)
    jumped_at: float | None = None
    jumped_by: float = 0.0
    finding: Finding | None = None
    since: float = 0.0
    heard: bool = False


class SensorMonitor(Component):
    """Looks at the sensors' messages now and then, and reports which are silent, frozen, black, blind or jumpy.

    A sensor is watched from its first message on, one of ``expected`` from the start. One whose port has no topic any
    more is not watched, unless it is expected. With another topic the watch begins again, without a finding. A sensor
    counts as frozen when it repeats exactly the same: noise keeps a working one from that. A pose counts as frozen when
    it stays exactly the same though the robot drives. A finding outlives the run, until a message refutes it. Pictures
    are rendered for this too, so leave ``image`` unconnected if only this would use them.
    """

    state_version = 1
    checkpoint_every = 1.0
    resources = Resources(cpu=0.03, memory=20.0)

    expected = Parameter(("odometry", "scan"), "sensors that must be heard from the start")
    first_within = Parameter(5.0, "how long the first message may take", minimum=0.0, unit="s")
    silent_after = Parameter(1.5, "how old the newest message may be", minimum=0.1, unit="s")
    frozen_after = Parameter(2.0, "how long the same may come again and again", minimum=0.1, unit="s")
    least_valid = Parameter(
        0.3, "share of the rays, or of the depths, that must hit something", minimum=0.0, maximum=1.0
    )
    most_gaps = Parameter(0.1, "share of neighbouring rays of which only one may hit", minimum=0.0, maximum=1.0)
    largest_jump = Parameter(0.2, "how far a pose may jump beyond what the robot can drive", minimum=0.0, unit="m")
    jumpy_for = Parameter(5.0, "how long a jump is held against a pose", minimum=0.0, unit="s")

    velocity_limit = robot_parameters.velocity_limit()
    turn_rate_limit = robot_parameters.turn_rate_limit()

    detection_delay = Quality("until a failure is reported", unit="s", better="lower", minimum=0.0, measured=False)
    faults = Quality("sensors with something wrong", better="lower", minimum=0.0, functional=True, estimated=False)

    image = Input(Image, latest_only=True, required=False, description="the pictures to watch")
    scan = Input(LaserScan, latest_only=True, required=False, description="the scans to watch")
    odometry = Input(Odometry, latest_only=True, required=False, description="the pose by the wheels to watch")
    localization = Input(Odometry, latest_only=True, required=False, description="the pose in the map to watch")
    depth = Input(DepthImage, latest_only=True, required=False, description="the depths to watch")
    velocity = Input(Twist, latest_only=True, required=False, description="the commanded motion")
    sensor_health = Output(SensorHealth, description="what is wrong")

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Return the ``detection_delay``: how long (s) it takes at the most until a failure is reported.

        ``context`` may give the ``rate`` (Hz) of the sensor (default 5). The sensor falls silent, or sends the same
        over and over; other failures are seen at the next look.
        """
        silent = float(parameters.get("silent_after", cls.silent_after.default))
        frozen = float(parameters.get("frozen_after", cls.frozen_after.default))
        period = 1.0 / float(context.get("rate", 5.0))
        # Two looks lie between the first of the same messages and the one that is reported: each comes up to one late.
        return {"detection_delay": max(silent + 1.0 / LOOKS, frozen + 2.0 / LOOKS + period)}

    @classmethod
    def check_parameters(cls, parameters: dict[str, Any], seed: int) -> None:
        """Refuse to expect a sensor that there is not."""
        _check_expected(parameters["expected"])

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Refuse to expect a sensor that there is not; raises ParameterError."""
        _check_expected(self.expected)

    def on_configure(self) -> None:
        """Begin without trouble; raises ParameterError if there is no such sensor to expect."""
        _check_expected(self.expected)
        self._watches = {name: _Watch(self._topic(name)) for name in SENSORS}

    def on_activate(self) -> None:
        """Begin to listen now."""
        self._listening_since = self.kit.now()

    @every(hz=LOOKS)
    def look(self) -> None:
        """Judge all sensors and publish the result."""
        now = self.kit.now()
        watched, faults = [], []
        for name in SENSORS:
            watch = self._watch(name, now)
            message = self._message(name, watch)
            watch.heard = watch.heard or message is not None
            if not watch.heard and name not in self.expected:
                continue
            topic = watch.topic or name
            watched.append(topic)
            finding = self._judge(message, watch, now)
            if finding is None and (message is None or message.stamp < self._listening_since):
                finding = watch.finding  # nothing has come since that would refute it
            self._take(topic, watch, finding, now)
            if watch.finding is not None:
                faults.append(SensorFault(topic, watch.finding.fault, watch.finding.text, watch.since))
        self.sensor_health.publish(SensorHealth(now, tuple(watched), tuple(faults)))

    def evaluate(self) -> dict[str, float]:
        """Return how many sensors have something wrong, as ``faults``."""
        return {"faults": float(sum(watch.finding is not None for watch in self._watches.values()))}

    def snapshot(self) -> PlainValue:
        """Return what is known of each sensor that was heard or has something wrong."""
        watches = self._watches.items()
        return {name: _remembered(watch) for name, watch in watches if watch.heard or watch.finding is not None}

    def restore(self, state: PlainValue) -> None:
        """Continue with what an earlier run found; what it knew of another topic ends with the next look."""
        for name, known in state.items():
            self._watches[name] = _resumed(known)

    def _watch(self, name: str, now: float) -> _Watch:
        """Return the record of a sensor."""
        watch, topic, latest = self._watches[name], self._topic(name), self.kit.inputs[name].latest
        if topic != watch.topic or (not topic and latest is not watch.before):
            # A port keeps its last message, which is no evidence of the topic that it has now.
            self._take(watch.topic or name, watch, None, now)
            before = latest if watch.topic or not topic else watch.before
            watch = self._watches[name] = _Watch(topic, now, before)
        return watch

    def _topic(self, name: str) -> str:
        """Return the topic of a sensor's port, empty for none."""
        return Keys(self.kit.system).topic_of(self.kit.inputs[name].key) or ""

    def _message(self, name: str, watch: _Watch) -> Message | None:
        message: Message | None = self.kit.inputs[name].latest
        return None if message is watch.before else message

    def _judge(self, message: Message | None, watch: _Watch, now: float) -> Finding | None:
        if message is None:
            quiet = now - max(self._listening_since, watch.began)
            return Finding(SILENT, f"not heard of for {quiet:.0f} s") if quiet > self.first_within else None
        if now - max(message.stamp, self._listening_since) > self.silent_after:
            watch.sameness.reset()
            return Finding(SILENT, f"silent since {message.stamp:.1f} s")
        if isinstance(message, Image):
            fingerprint = picture_fingerprint(message.pixels)
            return judge_picture(fingerprint) or self._frozen(watch, fingerprint, message.stamp)
        if isinstance(message, LaserScan):
            frozen = self._frozen(watch, scan_fingerprint(message.ranges), message.stamp)
            around = looks_all_around(message)
            return frozen or judge_scan(message.ranges, self.least_valid, self.most_gaps, all_around=around)
        if isinstance(message, DepthImage):
            frozen = self._frozen(watch, scan_fingerprint(message.depths), message.stamp)
            return frozen or judge_depths(message.depths, self.least_valid)
        return self._judge_pose(watch, message, now)

    def _frozen(self, watch: _Watch, content: object, stamp: float) -> Finding | None:
        seconds = watch.sameness.seconds(content, stamp)
        return Finding(FROZEN, "exactly the same comes again and again") if seconds >= self.frozen_after else None

    def _judge_pose(self, watch: _Watch, message: Odometry, now: float) -> Finding | None:
        limits = (self.velocity_limit, self.turn_rate_limit)
        jump = watch.jumps.jump(message.stamp, message.pose, limits, self.largest_jump)
        if jump > 0.0:
            watch.jumped_at, watch.jumped_by = now, jump
        if not (is_moving(message.twist) or self._is_commanded(now)):
            watch.sameness.reset()
        elif self._frozen(watch, message.pose, message.stamp):
            return Finding(FROZEN, "the pose stays exactly the same though the robot is to move")
        if watch.jumped_at is not None and now - watch.jumped_at <= self.jumpy_for:
            return Finding(JUMPY, f"the pose has jumped by {watch.jumped_by:.2f} (m or rad)", Level.WARNING)
        return None

    def _is_commanded(self, now: float) -> bool:
        command, envelope = self.velocity.latest, self.velocity.envelope
        if command is None or envelope is None:
            return False
        return is_moving(command) and now - envelope.stamp / 1e9 <= COMMAND_HOLDS

    def _take(self, topic: str, watch: _Watch, finding: Finding | None, now: float) -> None:
        """Take in a judgement, and report it where it changed."""
        before, watch.finding = watch.finding, finding
        if (finding.fault if finding else None) == (before.fault if before else None):
            return
        watch.since = now
        if finding is not None:
            self.kit.diagnose(topic, finding.level, finding.text, fault=finding.fault)
            self.kit.event(f"sensor.{finding.fault}", f"{topic}: {finding.text}", topic=topic, fault=finding.fault)
        elif before is not None:
            self.kit.diagnose(topic, Level.OK, f"not {before.fault} any more")
            self.kit.event("sensor.ok", f"{topic}: not {before.fault} any more", topic=topic, fault=before.fault)
        self.kit.checkpoint()  # a crash within the next second must not make a failed sensor a well one


def _remembered(watch: _Watch) -> PlainValue:
    """Return what a further run of the monitor continues with."""
    jumped = None if watch.jumped_at is None else [watch.jumped_at, watch.jumped_by]
    finding = watch.finding and [watch.finding.fault, watch.finding.text, watch.finding.level.value]
    return {"topic": watch.topic, "heard": watch.heard, "finding": finding, "since": watch.since, "jumped": jumped}


def _resumed(known: PlainValue) -> _Watch:
    """Return the record of a sensor as an earlier run of the monitor has left it."""
    watch = _Watch(known["topic"], since=known["since"], heard=known["heard"])
    if known["finding"] is not None:
        fault, text, level = known["finding"]
        watch.finding = Finding(fault, text, Level(level))
        if fault == FROZEN:
            watch.sameness.presume()
    if known["jumped"] is not None:
        watch.jumped_at, watch.jumped_by = known["jumped"]
    return watch


def _check_expected(names: Sequence[str]) -> None:
    unknown = [(index, name) for index, name in enumerate(names) if name not in SENSORS]
    if unknown:
        raise ParameterError([(f"expected.{index}", no_such("sensor", name, SENSORS)) for index, name in unknown])
