"""The components of the patrol, with the parameters of ``navigation.skills``, and a workshop that breaks them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from regraft import CallFailed, Component, Parameter, Quality, Records, RequestRefused, every, service
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.management.objectives import Objective, ObjectivesRequest, ObjectivesStatus
from tests.modes.parts import Killer

LOOK_EVERY = 0.1


@message("patrol/Condition")
@dataclass(frozen=True, slots=True)
class Condition:
    """Whether a component works; as a request to ``workshop/set`` whether it is to work."""

    component: str
    well: bool = True


@message("patrol/Measured")
@dataclass(frozen=True, slots=True)
class Measured:
    """The measured qualities of the patrol; a negative value is unknown."""

    safety: float = -1.0
    energy: float = -1.0


class Workshop(Component):
    """Knows which components are broken, and what is measured of the patrol."""

    safety = Quality("distance to obstacles", minimum=0.0, maximum=1.0, better="higher", estimated=False)
    energy = Quality("power that is needed", minimum=0.0, maximum=1.0, better="lower", estimated=False)
    evaluate_every = 0.2

    def __init__(self) -> None:
        self._broken: set[str] = set()
        self._measured = Measured()

    @service("workshop/set")
    def set(self, request: Condition) -> Condition:
        """Break a component, or mend it."""
        (self._broken.discard if request.well else self._broken.add)(request.component)
        return request

    @service("workshop/ask")
    def ask(self, request: Condition) -> Condition:
        """Report whether a component works."""
        return Condition(request.component, request.component not in self._broken)

    @service("workshop/measure")
    def measure(self, request: Measured) -> Measured:
        """Have other qualities from now on; a negative one is unknown."""
        self._measured = request
        return request

    def evaluate(self) -> dict[str, float]:
        """Return what is measured."""
        found = {"safety": self._measured.safety, "energy": self._measured.energy}
        return {name: value for name, value in found.items() if value >= 0.0}


@dataclass(frozen=True, slots=True)
class Happening:
    """A component breaks, or is mended, at a time (s)."""

    at: float
    component: str
    well: bool = False


class Schedule(Component):
    """Gives the metacontroller an objective, and has the workshop break and mend components at given times."""

    happenings = Records(Happening, "what happens when")

    def on_activate(self) -> None:
        """Begin."""
        self.kit.spawn(self._act(), "acting")

    async def _act(self) -> None:
        objective = Objective("to_navigate", "patrol", {"safety": 0.5, "energy": 0.5})
        request = ObjectivesRequest((objective,), self.kit.name)
        await self.kit.call("planners/metacontrol/objectives/add", request, ObjectivesStatus, timeout=30.0)
        for each in self.happenings:
            await self.kit.sleep(each.at - self.kit.now())
            await self.kit.call("workshop/set", Condition(each.component, each.well), Condition)


class Part(Killer):
    """Fails by itself when it is active and broken, and recovers when the workshop has mended it."""

    def on_activate(self) -> None:
        """Begin to look whether it is broken."""
        super().on_activate()
        self.kit.spawn(self._until_broken(), "until it breaks")

    def on_parameters(self, changed: frozenset[str]) -> None:
        """Kill as it is asked to when parameters are set."""
        self.at(f"{self.kit.name} set")

    def on_error(self) -> None:
        """Wait until it is mended."""
        self.kit.spawn(self._until_mended(), "until it is mended")

    async def _until_broken(self) -> None:
        while await self._works():
            await self.kit.sleep(LOOK_EVERY)
        self.kit.fail("it is broken")
        await self.kit.sleep(0.0)

    async def _until_mended(self) -> None:
        while not await self._works():
            await self.kit.sleep(LOOK_EVERY)
        self.kit.recovered()

    async def _works(self) -> bool:
        try:
            return (await self.kit.call("workshop/ask", Condition(self.kit.name), Condition, timeout=1.0)).well
        except (CallFailed, RequestRefused):
            return True


class Localizer(Part):
    """Stands for amcl."""

    transform_tolerance = Parameter(0.1, minimum=0.0, maximum=10.0, unit="s")


class Navigator(Part):
    """Stands for bt_navigator."""

    default_bt_xml_filename = Parameter("none.xml")


class Controller(Part):
    """Stands for controller_server, whose parameters have dotted names."""

    @classmethod
    def parameters_for(cls, parameters: dict[str, Any]) -> Iterable[Parameter[Any]]:
        """Return those of its plugin."""
        yield Parameter(0.0, minimum=0.0, maximum=1.0, unit="m/s").renamed("FollowPath.max_vel_x", 0.25)
        yield Parameter(0.0, minimum=0.0, unit="s").renamed("FollowPath.transform_tolerance", 0.3)


class Beacon(Part):
    """Stands for a driver without parameters: of the laser, the camera, the battery."""

    @every(hz=5)
    def shine(self) -> None:
        """Do something now and then."""
