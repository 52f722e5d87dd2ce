"""A tree with a node of one's own: it heats a room until it is warm, and gives up if that takes too long."""

import sys
from typing import TextIO

from behavior_tree import RUNNING, SUCCESS, Input, ManualClock, Output, Registry, StatefulAction, Status, load_text

TREE = """
<root BTCPP_format="4">
  <BehaviorTree ID="Thermostat">
    <Timeout msec="60000">
      <Heat wanted="{wanted}" measured="{measured}"/>
    </Timeout>
  </BehaviorTree>
</root>
"""
STEP = 5.0
"""Seconds between two ticks."""
DEGREES_PER_TICK = 0.5


class Heat(StatefulAction):
    """Heats until the wanted temperature (°C) is measured."""

    wanted = Input(float)
    measured = Output(float)

    def on_start(self) -> Status:
        """Begin with a cold room."""
        self._temperature = 18.0
        return self.on_running()

    def on_running(self) -> Status:
        """Heat a little more."""
        self._temperature += DEGREES_PER_TICK
        self.measured = self._temperature
        return SUCCESS if self._temperature >= self.wanted else RUNNING

    def on_halted(self) -> None:
        """Switch the heater off."""


def run(wanted: float, out: TextIO) -> Status:
    """Run the tree on a clock that is set by hand, and print each tick."""
    registry, clock = Registry(), ManualClock()
    registry.register(Heat)
    tree = load_text(TREE, registry, clock=clock)
    tree.blackboard.set("wanted", wanted)
    while (status := tree.tick_once()) == RUNNING:
        print(f"{clock.now():4.0f} s: {tree.blackboard.get('measured')} °C", file=out)
        clock.advance(STEP)
    print(f"{clock.now():4.0f} s: {'warm' if status == SUCCESS else 'given up'}", file=out)
    return status


if __name__ == "__main__":
    run(20.0, sys.stdout)
