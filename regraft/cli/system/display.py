"""The display of ``up`` while a system runs: plain lines, and on a terminal a live line below them."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Protocol

from rich.live import Live
from rich.text import Text

from regraft.bus_schema.messages.health import Event
from regraft.bus_schema.messages.mission import MissionStatus
from regraft.bus_schema.messages.power import BatteryState
from regraft.bus_schema.messages.protocol.clock import ClockTime
from regraft.cli.terminal.output import complain, console, harmless, say
from regraft.cli.terminal.standard_streams import CannotWrite
from regraft.process.printed import give_up_output

MISSION_MARKS = 48
"""Characters of the running node's name that are shown."""


class Display(Protocol):
    """Where lines go."""

    def line(self, text: str) -> None:
        """Show a line that stays."""

    def status(self, text: str) -> None:
        """Show what holds now, in place of what was shown so before."""

    def close(self) -> None:
        """Show nothing any more."""


class Quiet:
    """Shows nothing."""

    def line(self, text: str) -> None:
        """Drop it."""

    def status(self, text: str) -> None:
        """Drop it."""

    def close(self) -> None:
        """Nothing to do."""


class Lines(Quiet):
    """Shows lines that stay, and no others."""

    def line(self, text: str) -> None:
        """Print it at once, even into a pipe."""
        say(text)
        sys.stdout.flush()


class Terminal:
    """Shows a live line on a terminal, without a thread: the system's processes are forked from this one."""

    def __init__(self) -> None:
        """Start with an empty live line."""
        self._live = Live(Text(""), console=console(), auto_refresh=False, transient=True)
        self._live.start()

    def line(self, text: str) -> None:
        """Print it above the live line."""
        self._live.console.print(harmless(text))

    def status(self, text: str) -> None:
        """Replace the live line."""
        self._live.update(Text(harmless(text), style="dim", no_wrap=True, overflow="ellipsis"), refresh=True)

    def close(self) -> None:
        """Remove the live line."""
        self._live.stop()


class Expendable:
    """Gives output up once it cannot be written: a robot does not stop because nobody can read of it."""

    def __init__(self, shown: Display) -> None:
        """Show all on ``shown`` for as long as that works."""
        self._shown = shown

    def line(self, text: str) -> None:
        """Show it if that works."""
        with _expendable():
            self._shown.line(text)

    def status(self, text: str) -> None:
        """Show it if that works."""
        with _expendable():
            self._shown.status(text)

    def close(self) -> None:
        """Close it if that works."""
        with _expendable():
            self._shown.close()


@contextmanager
def _expendable() -> Iterator[None]:
    try:
        yield
    except (CannotWrite, BrokenPipeError) as error:
        give_up_output()
        why = error if isinstance(error, CannotWrite) else "nobody reads standard output any more"
        complain(f"{why}; the system runs on, unseen")


def display(*, headless: bool, quiet: bool) -> Display:
    """Return the display that fits: a live one only for people at a terminal."""
    if quiet:
        return Quiet()
    return Expendable(Terminal() if sys.stdout.isatty() and not headless else Lines())


def event_line(event: Event, clock: ClockTime | None) -> str:
    """Return an event as one line, led by simulated time, or by the time of day where there is none."""
    when = f"{clock.time / 1e9:.2f} s" if clock else time.strftime("%H:%M:%S")
    # The host's and the components' texts name their subject; the others' need not.
    text = event.text if event.subject in event.text else f"{event.subject}: {event.text}"
    return f"{when:>10}  {event.kind:<22}  {' '.join(text.split())}"


def status_line(
    clock: ClockTime | None, missions: Mapping[str, MissionStatus], batteries: Mapping[str, BatteryState], up_for: float
) -> str:
    """Return the live line: time, speed, what the mission does, the battery; of several robots each by its name."""
    parts = [f"{clock.time / 1e9:.1f} s simulated, {clock.speed:.1f} x" if clock else f"{up_for:.0f} s"]
    if clock and clock.waiting_for:
        parts.append(f"waiting for {', '.join(clock.waiting_for)}")
    for robot, mission in missions.items():
        node = mission.running[-1].rsplit("/", 1)[-1].partition("::")[0] if mission.running else ""
        label = f"{robot} " if len(missions) > 1 else ""
        parts.append(f"{label}mission {mission.state.value}{': ' if node else ''}{node[:MISSION_MARKS]}")
    for robot, battery in batteries.items():
        label = f"{robot} " if len(batteries) > 1 else ""
        parts.append(f"{label}battery {battery.charge:.0%}")
    return "  |  ".join(parts)
