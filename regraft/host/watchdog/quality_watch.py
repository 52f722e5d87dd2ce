"""Watches whether components publish the qualities that they measure; silence is unknown, and after a while a fault.

All times are on the component's own clock: that of its last heartbeat against that of its last measurement. So nobody
is late while simulated time is paused, and a component that hangs is the watchdog's affair.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from regraft.bus_schema.messages.health import ComponentStatus, Level
from regraft.bus_schema.messages.management.qualities import SILENT_PERIODS, MeasuredQualities
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.host.host_publisher import HostPublisher

SUBJECT = "qualities"


@dataclass(slots=True)
class _Watched:
    """``last`` is when the run measured last or became active, in seconds of its clock."""

    last: float
    silent: bool = False


class QualityWatch:
    """Judges the components of one host by their heartbeats."""

    def __init__(self, publisher: HostPublisher) -> None:
        self._publisher = publisher
        self._watched: dict[tuple[str, int], _Watched] = {}

    def measured(self, qualities: MeasuredQualities) -> None:
        """Take what a component has measured."""
        watched = self._watched.get((qualities.component, qualities.incarnation))
        if watched is None:
            return
        watched.last = qualities.stamp
        if watched.silent:
            watched.silent = False
            self._report(qualities.component, Level.OK, "quality.heard", "measures its qualities again")

    def beats(self, spec: ComponentSpec, status: ComponentStatus) -> None:
        """Take a heartbeat, and report a run that is active and has been silent for too long."""
        described, run = spec.description, (status.component, status.incarnation)
        if described is None or described.evaluate_every is None or status.state is not State.ACTIVE:
            self._watched.pop(run, None)
            return
        watched = self._watched.setdefault(run, _Watched(status.stamp))
        silent = status.stamp - watched.last
        if silent > SILENT_PERIODS * described.evaluate_every and not watched.silent:
            watched.silent = True
            text = f"has measured no qualities for {silent:.1f} s, its class does every {described.evaluate_every:g} s"
            self._report(status.component, Level.ERROR, "quality.silent", text)

    def forget_all_but(self, is_known: Callable[[str], bool]) -> None:
        """Forget the runs of components that this host runs no longer."""
        for run in [run for run in self._watched if not is_known(run[0])]:
            del self._watched[run]

    def _report(self, component: str, level: Level, kind: str, text: str) -> None:
        self._publisher.event(kind, component, f"{component} {text}")
        self._publisher.diagnose(component, SUBJECT, level, text)
