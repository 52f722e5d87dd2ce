"""Writes down where a robot really was, for the tests to judge."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from regraft import Component, Input, Parameter, every
from regraft.bus_schema.messages.world import GroundTruth

FIELDS = ("time", "x", "y", "speed", "contacts")


class Witness(Component):
    """Writes one line for each ground truth: time (s), place (m), speed (m/s), and contacts so far."""

    file = Parameter("", "where it writes", unit="path")

    ground_truth = Input(GroundTruth, keep=4096, description="what the robot really did")

    @every(hz=1.0)
    def write(self) -> None:
        """Write what has come since the last time."""
        with Path(self.file).open("a") as file:
            for truth in self.ground_truth.take():
                pose = truth.pose
                line = (truth.stamp, pose.x, pose.y, truth.twist.forward, truth.contacts)
                file.write(json.dumps(dict(zip(FIELDS, line, strict=True))) + "\n")


def written(file: Path) -> list[dict[str, Any]]:
    """Return the lines that a witness has written."""
    return [json.loads(line) for line in file.read_text().splitlines()]
