"""Records what a run did, in numbers and as a digest."""

from __future__ import annotations

import math
from collections import Counter

from regraft import Component, Input, every, service
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.evaluation import RunSummary, RunSummaryRequest
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.maps import Goals
from regraft.bus_schema.messages.perception import Detections
from regraft.bus_schema.messages.world import GroundTruth
from regraft.bus_schema.model.adaptation import AdaptationReport
from regraft.bus_schema.model.description import Resources
from regraft.evaluation.digests import START, adaptation_bytes, combined, extended

AT_GOAL = 0.25
"""m from a goal's position: Nav2's default tolerance."""
FACING = 0.3
"""rad from a goal's heading: one place may be the goal of two objects, seen in two directions."""
STANDING = 0.03
"""m/s and rad/s: slower than this is standing."""


class Recorder(Component):
    """Sums up a run: where the robot went, what was seen, what was adapted.

    It wakes once a second and disturbs nobody. The digest covers every ground truth, every picture's
    detections and every adaptation, in their order. Where a system has several robots, each has a recorder.
    """

    resources = Resources(cpu=0.02, memory=20.0)
    state_version = 1
    checkpoint_every = 1.0

    ground_truth = Input(GroundTruth, keep=4096, required=False, description="what the robot really did")
    goals = Input(Goals, latest_only=True, required=False, description="whose visits are counted")
    detections = Input(Detections, keep=4096, required=False)
    adaptations = Input(AdaptationReport, keep=4096, required=False)

    def on_configure(self) -> None:
        """Begin without a record."""
        self._chains = {"ground_truth": START, "detections": START, "adaptations": START}
        self._counts: dict[str, Counter[str]] = {
            name: Counter() for name in ("visits", "pictures", "hits", "adaptations")
        }
        self._ticks = self._contacts = 0
        self._distance = 0.0
        self._position: tuple[float, float] | None = None
        self._at = ""

    @every(hz=1.0)
    def absorb(self) -> None:
        """Take in what has come since the last time."""
        for truth in self.ground_truth.take():
            self._extend("ground_truth", codec.encode(truth))
            self._follow(truth)
        for detections in self.detections.take():
            self._extend("detections", codec.encode(detections))
            self._counts["pictures"][detections.camera] += 1
            self._counts["hits"][detections.camera] += bool(detections.objects)
        for report in self.adaptations.take():
            self._extend("adaptations", adaptation_bytes(report))
            self._counts["adaptations"][report.outcome.value] += 1

    def _extend(self, chain: str, payload: bytes) -> None:
        self._chains[chain] = extended(self._chains[chain], payload)

    def _follow(self, truth: GroundTruth) -> None:
        position = (truth.pose.x, truth.pose.y)
        if self._position is not None:
            self._distance += math.dist(self._position, position)
        self._position = position
        self._ticks, self._contacts = truth.tick, truth.contacts
        if abs(truth.twist.forward) < STANDING and abs(truth.twist.turn) < STANDING:
            self._note_visit(truth.pose)

    def _note_visit(self, pose: Pose) -> None:
        """Count a visit when the robot stands at another goal than at the last visit, and faces its object."""
        known = self.goals.latest
        here = {
            goal.name: abs(math.remainder(pose.yaw - goal.pose.pose.yaw, math.tau))
            for goal in (known.goals if known else ())
            if math.dist((pose.x, pose.y), (goal.pose.pose.x, goal.pose.pose.y)) <= AT_GOAL
        }
        faced = min(here, key=lambda name: here[name], default="")
        if faced and faced != self._at and here[faced] <= FACING:
            self._at = faced
            self._counts["visits"][faced] += 1

    @service("run_summary")
    def run_summary(self, request: RunSummaryRequest) -> RunSummary:
        """Sum up the run so far."""
        self.absorb()
        return RunSummary(
            self.kit.now(),
            combined(self._chains),
            self._ticks,
            self._contacts,
            self._distance,
            *(dict(sorted(counter.items())) for counter in self._counts.values()),
        )

    def snapshot(self) -> PlainValue:
        """Return the record."""
        self.absorb()
        return {
            "chains": self._chains,
            "counts": {name: dict(counter) for name, counter in self._counts.items()},
            "ticks": self._ticks,
            "contacts": self._contacts,
            "distance": self._distance,
            "position": None if self._position is None else list(self._position),
            "at": self._at,
        }

    def restore(self, state: PlainValue) -> None:
        """Continue a record; what happened in between is missing from it."""
        self._chains = dict(state["chains"])
        self._counts = {name: Counter(counts) for name, counts in state["counts"].items()}
        self._ticks, self._contacts = state["ticks"], state["contacts"]
        self._distance, self._at = state["distance"], state["at"]
        position = state["position"]
        self._position = None if position is None else (position[0], position[1])
