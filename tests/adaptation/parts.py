"""Small components that the promises are tested on."""

from __future__ import annotations

import threading
from typing import ClassVar

from regraft import Component, Input, Output, Parameter, every
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.geometry import Twist, Vector3
from regraft.bus_schema.messages.quality import Quality
from regraft.bus_schema.messages.sensors import LaserScan
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Add, Connect, Remove
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.watched import Condition
from regraft.component import quality
from regraft.lockstep.source import TimeSource
from tests.support.waiting import PATIENCE

ADAPT = "adaptation_manager/adapt"


class Talker(Component):
    """Counts aloud."""

    numbers = Output(Twist)
    rate = Parameter(200.0, minimum=0.0, maximum=5000.0, unit="Hz")
    sent: int = 0

    @every(hz=rate)
    def talk(self) -> None:
        """Say the next number."""
        self.sent += 1
        self.numbers.publish(Twist(Vector3(float(self.sent))))


class Listener(Component):
    """Remembers what it hears, of whom."""

    heard = Input(Twist, topic="numbers")
    hint = Input(Twist, topic="hints", required=False)
    gain = Parameter(0.5, minimum=0.0, maximum=1.0)
    label = Parameter("plain", choices=("plain", "fancy"))
    note = Parameter("")
    fixed = Parameter(1, read_only=True)

    def on_configure(self) -> None:
        """Forget everything."""
        self.log: list[tuple[str, int]] = []

    @heard.handler
    def hear(self, message: Twist) -> None:
        """Remember a number."""
        envelope = self.heard.envelope
        assert envelope is not None
        self.log.append((envelope.source, int(message.linear.x)))


class Fragile(Component):
    """Breaks where it is told to: its ``release`` lets a hung one go on."""

    heard = Input(Twist, topic="numbers", required=False)
    level = Parameter(0, minimum=0, maximum=10)
    mood = Parameter("well", choices=("well", "refuses", "hangs", "dies", "fails", "clings", "drowns"))
    release: ClassVar[threading.Event] = threading.Event()

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Refuse, hang or die, as the mood is."""
        if self.mood == "refuses" and "level" in changed:
            raise ValueError("not in this mood")
        if self.mood == "hangs" and "level" in changed:
            self.release.wait(PATIENCE)
        if self.mood == "dies" and "level" in changed:
            self.release.wait(PATIENCE)
            raise SystemExit

    def on_activate(self) -> None:
        """Fail, as the mood is."""
        if self.mood == "fails":
            raise RuntimeError("cannot be activated in this mood")

    def on_deactivate(self) -> None:
        """Fail, as the mood is."""
        if self.mood in ("clings", "drowns"):
            raise RuntimeError("cannot be deactivated in this mood")

    def on_error(self) -> None:
        """Fail once more, as the mood is."""
        if self.mood == "drowns":
            raise RuntimeError("cannot recover in this mood")


class Newcomer(Component):
    """Breaks as it is started, where and how it is told to; otherwise it says what it hears."""

    heard = Input(Twist, topic="numbers")
    said = Output(Twist, topic="spare")
    where = Parameter("nowhere", choices=("nowhere", "configure", "activate"))
    how = Parameter("refuses", choices=("refuses", "hangs", "dies"))
    gain = Parameter(0.5, minimum=0.0, maximum=1.0)
    release: ClassVar[threading.Event] = threading.Event()

    def on_configure(self) -> None:
        """Break, or not."""
        self.log: list[int] = []
        self._break("configure")

    def on_activate(self) -> None:
        """Break, or greet."""
        self._break("activate")
        self.said.publish(Twist(Vector3(-1.0)))

    def _break(self, where: str) -> None:
        if self.where != where:
            return
        if self.how == "refuses":
            raise RuntimeError("no life in me")
        self.release.wait(PATIENCE)
        raise SystemExit

    @heard.handler
    def hear(self, message: Twist) -> None:
        """Say it again."""
        self.log.append(int(message.linear.x))
        self.said.publish(message)


class Lamp(Component):
    """Says what it would cost."""

    heard = Input(Twist, topic="numbers", required=False)
    level = Parameter(1.0, minimum=0.0, maximum=10.0)

    power = quality.Quality("of the lamp", unit="W", better="lower", minimum=0.0, measured=False)
    light = quality.Quality("in the dark", better="higher", minimum=0.0, measured=False)

    @classmethod
    def estimate(cls, parameters: dict[str, PlainValue], context: dict[str, PlainValue]) -> dict[str, float]:
        """Need a watt a level, and give light where it is dark."""
        level, darkness = parameters["level"], context.get("darkness", 0.0)
        assert isinstance(level, float)
        assert isinstance(darkness, float)
        if level > 9.0:
            raise ValueError("too bright to say")
        return {"power": level, "light": level * darkness}


class Meter(Component):
    """Measures what it cannot estimate."""

    evaluate_every = 0.1

    share = Parameter(0.5, minimum=0.0, maximum=1.0)
    level = quality.Quality(estimated=False)

    def evaluate(self) -> dict[str, float]:
        """Return the share."""
        return {"level": self.share}


class Scanner(Component):
    """Writes a topic of another type."""

    scan = Output(LaserScan)


class Ticker(TimeSource):
    """A world in which a number is counted up."""

    count = Output(Twist)
    echo = Output(Twist)
    number: int = 0

    def advance(self, tick: int, seconds: float) -> None:
        """Say the next number, twice."""
        self.number += 1
        self.count.publish(Twist(Vector3(float(self.number))))
        self.echo.publish(Twist(Vector3(float(self.number))))


class Keeper(Component):
    """Collects numbers without being woken by them, and looks at them now and then."""

    quiet = Input(Twist, topic="count", keep=1000)

    def on_configure(self) -> None:
        """Forget everything."""
        self.collected: list[int] = []

    @every(seconds=0.35)
    def look(self) -> None:
        """Take what has come."""
        self.collected += [int(message.linear.x) for message in self.quiet.take()]


class Collector(Component):
    """Collects numbers as they come."""

    loud = Input(Twist, topic="echo")

    def on_configure(self) -> None:
        """Forget everything."""
        self.collected: list[int] = []

    @loud.handler
    def hear(self, message: Twist) -> None:
        """Remember a number."""
        self.collected.append(int(message.linear.x))


class Planner(Component):
    """Adapts the collector at certain times, and remembers what became of it."""

    def on_activate(self) -> None:
        """Begin to adapt."""
        self.reports: list[AdaptationReport] = []
        self.kit.spawn(self.adapt(), "adapting")

    async def adapt(self) -> None:
        """Let two inputs change places, again and again."""
        for topic, other in (("echo", "count"), ("count", "echo")) * 3:
            await self.kit.sleep(0.4)
            changes = (Connect("keeper", "quiet", topic), Connect("collector", "loud", other))
            request = AdaptationRequest(changes, reason=f"to {topic}", actor="planner")
            self.reports.append(await self.kit.call(ADAPT, request, AdaptationReport, timeout=PATIENCE))


class Judge(Component):
    """Tells of a quality requirement, which is not met while a certain number of numbers has been heard."""

    heard = Input(Twist, topic="echo")
    broken_from = Parameter(10, minimum=0)
    broken_until = Parameter(20, minimum=0)

    @heard.handler
    def hear(self, message: Twist) -> None:
        """Tell how it is met."""
        number = message.linear.x
        satisfied = not self.broken_from <= number < self.broken_until
        self.kit.report_quality(Quality(self.kit.now(), "Steady", "Calm", metric=number, satisfied=satisfied))


class Confirmer(Component):
    """Adapts the collector at certain times, and has it watched for a while each time."""

    def on_activate(self) -> None:
        """Begin to adapt."""
        self.reports: list[AdaptationReport] = []
        self.kit.spawn(self.adapt(), "adapting")

    async def adapt(self) -> None:
        """Move an input away from where it is, and back."""
        for topic, other in (("echo", "count"), ("count", "echo")) * 2:
            await self.kit.sleep(0.4)
            changes = (Connect("keeper", "quiet", topic), Connect("collector", "loud", other))
            request = AdaptationRequest(changes, actor="confirmer", confirm=0.5, watch=(Condition("Steady"),))
            self.reports.append(await self.kit.call(ADAPT, request, AdaptationReport, timeout=PATIENCE))


class Changer(Component):
    """Adds a collector and removes it, at certain times, and remembers what became of it."""

    def on_activate(self) -> None:
        """Begin to adapt."""
        self.reports: list[AdaptationReport] = []
        self.kit.spawn(self.adapt(), "adapting")

    async def adapt(self) -> None:
        """Let one come and go, again and again."""
        spec = ComponentSpec(cls="tests.adaptation.parts:Collector")
        for change in (Add("extra", spec), Remove("extra")) * 3:
            await self.kit.sleep(0.37)
            request = AdaptationRequest((change,), actor="changer")
            self.reports.append(await self.kit.call(ADAPT, request, AdaptationReport, timeout=PATIENCE))
