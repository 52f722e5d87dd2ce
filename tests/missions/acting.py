"""A robot that can be adapted: an adaptation manager that acts, what the system reflection tells, and two cameras."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from regraft import Component, Output, Parameter, every, service
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.management.manager import (
    ArchitectureRequest,
    ArchitectureTag,
    ArchitectureTagRequest,
)
from regraft.bus_schema.messages.protocol.control import Rewire, RewireStep
from regraft.bus_schema.messages.reflection import ReflectedEntries, ReflectedEntry
from regraft.bus_schema.messages.sensors import Image
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    ChangeState,
    Connect,
    Outcome,
    SetParameters,
    Violation,
)
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.runtime.core.pending import Pending
from regraft.stack import load
from regraft.testing import Rig
from tests.missions.robot import STACKS

OWN, CORNER = "camera/image", "corner_camera/image"
AFTER = {Transition.ACTIVATE: State.ACTIVE, Transition.DEACTIVATE: State.INACTIVE}


class ActingManager(Component):
    """Speaks for the adaptation manager of a stack: checks as it does, and changes what there is of it in the rig.

    ``fates`` says how the next adaptations end that are right: one of the outcomes, or ``silent``.
    """

    def __init__(self) -> None:
        self.rig: Rig | None = None
        self.architecture: Architecture | None = None
        self.fates: list[Outcome | str] = []
        self.reports: list[AdaptationReport] = []

    def manage(self, rig: Rig, stack: str) -> None:
        """Begin with a stack as its file has it."""
        self.rig = rig
        self.architecture = load(STACKS / f"{stack}.yaml").architecture

    def looks_through(self, topic: str) -> bool:
        """Return whether the detector looks at the pictures of a topic."""
        assert self.architecture is not None
        return self.architecture.components["detector"].connections["image"] == topic

    @property
    def requests(self) -> list[AdaptationRequest]:
        """What was asked for so far."""
        return [report.request for report in self.reports]

    @property
    def changes(self) -> list[Any]:
        """The changes that were applied so far, in their order."""
        applied = [report for report in self.reports if report.outcome is Outcome.APPLIED]
        return [change for report in applied for change in report.request.changes]

    @service("adaptation_manager/architecture_tag")
    def tag(self, request: ArchitectureTagRequest) -> ArchitectureTag:
        """Show the tag of the architecture."""
        assert self.architecture is not None
        return ArchitectureTag(str(self.architecture.revision))

    @service("adaptation_manager/architecture")
    def show(self, request: ArchitectureRequest) -> Architecture:
        """Show the architecture."""
        assert self.architecture is not None
        return self.architecture

    @service("adaptation_manager/adapt")
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        """Carry a request out, or do what the next fate says."""
        before = self.architecture
        assert before is not None
        after, wrong = before, self._stale(request)
        for change in request.changes:
            after = changed(after, change)
        wrong = wrong or violations(after)
        fate = Outcome.REJECTED if wrong else self.fates.pop(0) if self.fates else Outcome.APPLIED
        if fate == "silent":
            await self.kit.sleep(1000.0)
        assert isinstance(fate, Outcome)
        if fate is Outcome.APPLIED:
            for change in request.changes:
                self._act(change)
            self.architecture = after = replace(after, revision=before.revision + 1)
        error = "it broke" if fate in (Outcome.ROLLED_BACK, Outcome.STUCK) else ""
        report = AdaptationReport(
            str(len(self.reports) + 2),
            fate,
            request,
            before.revision,
            self.architecture.revision if self.architecture else 0,
            self.kit.now(),
            violations=wrong,
            error=error,
        )
        self.reports.append(report)
        return report

    def _stale(self, request: AdaptationRequest) -> tuple[Violation, ...]:
        assert self.architecture is not None
        is_stale = request.revision not in (None, self.architecture.revision)
        return (Violation(None, "", "revision", "is stale"),) if is_stale else ()

    def _act(self, change: Any) -> None:
        assert self.rig is not None
        runtime = self.rig.runtimes.get(change.component)
        if runtime is None:
            return
        if isinstance(change, SetParameters):
            runtime.parameters.set(change.parameters)
            runtime.component.on_parameters(frozenset(change.parameters))
        elif isinstance(change, Connect) and change.topic is not None and change.port in runtime.inputs:
            for step in (RewireStep.OPEN, RewireStep.SWITCH):
                done = runtime.rewiring.step(Rewire(step, change.port, change.topic))
                if isinstance(done, Pending):
                    done.finish()


def changed(architecture: Architecture, change: Any) -> Architecture:
    """Return an architecture as a change leaves it."""
    spec = architecture.components[change.component]
    if isinstance(change, SetParameters):
        spec = replace(spec, parameters={**spec.parameters, **change.parameters})
    elif isinstance(change, Connect):
        spec = replace(spec, connections={**spec.connections, change.port: change.topic})
    elif isinstance(change, ChangeState):
        spec = replace(spec, state=AFTER[change.transition])
    return architecture.with_component(spec)


class Senses(Component):
    """Tells what the system reflection of FROG's stacks tells: the robot drives at 0.26 m/s, nothing is near."""

    reflection = Output(ReflectedEntries)

    def __init__(self) -> None:
        self.manager: ActingManager | None = None
        self.values: dict[str, Any] = {"speed": 0.26, "nearest": 2.0, "motion_power": 6.63}

    @every(hz=10)
    def tell(self) -> None:
        """Tell it."""
        now = self.kit.now()
        architecture = self.manager.architecture if self.manager else None
        values = dict(self.values)
        if architecture is not None:
            values["image_topic"] = architecture.components["detector"].connections["image"]
        entries = (ReflectedEntry(key, value, now, round(now * 10)) for key, value in values.items())
        self.reflection.publish(ReflectedEntries(now, tuple(entries)))


class PlainCamera(Component):
    """Sends noise, which is all that a detector needs to see that its camera works, and fails as it is told."""

    failure = Parameter("none", choices=("none", "black", "frozen", "silent"))
    image = Output(Image)

    _last: np.ndarray[Any, Any] | None = None

    @every(hz=5)
    def take_picture(self) -> None:
        """Send a picture."""
        noise = np.random.default_rng(round(self.kit.now() * 10)).integers(0, 255, (24, 32, 3), np.uint8)
        if self.failure == "black":
            self._last = np.zeros_like(noise)
        elif self.failure != "frozen" or self._last is None:
            self._last = noise
        if self.failure != "silent":
            mounted_on = "base_link" if self.kit.name == "camera" else "map"
            self.image.publish(Image(self.kit.now(), f"{self.kit.name}_optical", mounted_on, Pose(), 1.0, self._last))
