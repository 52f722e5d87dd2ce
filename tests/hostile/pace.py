"""The pace of a mission: its own pulse, and a metronome in another process."""

from __future__ import annotations

import time
from pathlib import Path

from behavior_tree import SUCCESS, Input, Status, SyncAction
from regraft import Component, Parameter, every


class Pulse(SyncAction):
    """Writes to a file how many seconds of a processor the mission's thread and its whole process have used."""

    file = Input(str)

    def tick(self) -> Status:
        """Write a line."""
        with Path(self.file).open("a", encoding="utf-8") as file:
            file.write(f"{time.thread_time()} {time.process_time()}\n")
        return SUCCESS


class Metronome(Component):
    """Writes the time of each beat to a file, a line each; beats as often as the mission ticks."""

    file = Parameter("", unit="path")

    @every(hz=10)
    def beat(self) -> None:
        """Write a line."""
        with Path(self.file).open("a", encoding="utf-8") as file:
            file.write(f"{self.kit.now()}\n")
