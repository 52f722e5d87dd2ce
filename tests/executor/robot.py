"""A small robot: it offers what FROG's navigator and detector offer, and remembers what it was asked."""

from __future__ import annotations

from regraft import Cancelled, Component, Parameter, RequestRefused, action, service
from regraft.bus_schema.messages.geometry import FramedPose, Pose, Vector3
from regraft.bus_schema.messages.maps import Goals, NamedGoal
from regraft.bus_schema.messages.navigation import Arrival, NavigateTo, NavigationProgress
from regraft.bus_schema.messages.perception import Detect, Detection, Sightings

PLACES = ("north", "east", "south", "west")


def goals(*names: str) -> Goals:
    """Return goals with these names, a metre apart along x."""
    places = (NamedGoal(name, FramedPose("map", Pose.planar(float(i), 0.0, 0.0))) for i, name in enumerate(names))
    return Goals(0.0, tuple(places))


class Navigator(Component):
    """Arrives at every goal after a while; may fail for the first goals it is given."""

    seconds = Parameter(2.0, "how long each drive takes", unit="s")
    failures = Parameter(0, "how many drives fail at first")

    def __init__(self) -> None:
        self.asked: list[float] = []
        self.reached: list[float] = []
        self.cancelled: list[float] = []

    @action("navigate_to", feedback=NavigationProgress)
    async def navigate_to(self, goal: NavigateTo) -> Arrival:
        """Drive."""
        x = goal.goal.pose.x
        self.asked.append(x)
        self.kit.feedback(NavigationProgress(1.5, self.seconds, "driving"))
        try:
            await self.kit.sleep(self.seconds)
        except Cancelled:
            self.cancelled.append(x)
            raise
        if len(self.asked) <= self.failures:
            return Arrival(False, Pose(), "the way is blocked")
        self.reached.append(x)
        return Arrival(True, goal.goal.pose)


class Detector(Component):
    """Sees the object in every picture, at (1, 2)."""

    failures = Parameter(0, "how many requests are refused at first")
    paid = Parameter(-1, "how many pictures take energy; below 0: it does not report that")
    picture_energy = Parameter(0.0, "what they take, if it reports that", unit="J")

    def __init__(self) -> None:
        self.asked: list[Detect] = []

    @service("detect")
    async def detect(self, request: Detect) -> Sightings:
        """Look."""
        self.asked.append(request)
        if len(self.asked) <= self.failures:
            raise RequestRefused("no picture came")
        await self.kit.sleep(0.25)
        best = Detection(request.label, 0.9, "map", Vector3(1.0, 2.0, 0.0), 0.1, 1.0)
        pictures = request.pictures or 1
        if self.paid < 0:
            return Sightings(pictures, pictures, best)
        return Sightings(pictures, pictures, best, paid=self.paid, picture_energy=self.picture_energy)


class Porter(Component):
    """Carries two things at once."""

    def __init__(self) -> None:
        self.carried: list[str] = []

    @action("carry", goals=2)
    async def carry(self, what: Detect) -> Sightings:
        """Carry something."""
        await self.kit.sleep(1.0)
        self.carried.append(what.label)
        return Sightings(1, 1)
