"""Components for attacks."""

from __future__ import annotations

import os
import time

from regraft import Component, Output, Parameter, every
from tests.host.parts import Tick


class Actor(Component):
    """Acts a hundred times a second: publishes, and writes down when, and which process it was."""

    ticks = Output(Tick)
    acts = Parameter("", "the file of all acts, of all runs")

    def on_activate(self) -> None:
        self.count = 0
        self.file = os.open(self.acts, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)

    @every(hz=100)
    def act(self) -> None:
        self.count += 1
        self.ticks.publish(Tick(self.count))
        os.write(self.file, f"{os.getpid()} {time.clock_gettime_ns(time.CLOCK_BOOTTIME)}\n".encode())
