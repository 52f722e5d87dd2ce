"""Writes down twice a second which components of the skills are active."""

from __future__ import annotations

from pathlib import Path

from regraft import Component, Input, Parameter, every
from regraft.bus_schema.messages.management.system import SystemStates
from regraft.bus_schema.model.lifecycle import State


class Witness(Component):
    """A line for each half second: the time, and the names of what is active."""

    file = Parameter("", "the file that is written", unit="path", read_only=True)

    states = Input(SystemStates, topic="system/states", latest_only=True)

    @every(hz=2.0)
    def write(self) -> None:
        """Write a line."""
        known = self.states.latest
        active = [each.component for each in known.components if each.state is State.ACTIVE] if known else []
        with Path(self.file).open("a", encoding="utf-8") as file:
            file.write(f"{self.kit.now():.2f} {' '.join(sorted(active))}\n")


def read(file: Path) -> list[tuple[float, frozenset[str]]]:
    """Return what a witness has written."""
    lines = [line.split() for line in file.read_text(encoding="utf-8").splitlines()]
    return [(float(line[0]), frozenset(line[1:])) for line in lines]
