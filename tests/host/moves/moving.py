"""A counted stream over two hosts, with a service and an action, whose middle part can be moved."""

from __future__ import annotations

from typing import Any

from regraft.bus_schema.messages.protocol.host import ProcessState, ProcessStatus
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Change, Move
from tests.handover.parts import Ask, Asked, Item, Report
from tests.host.adapting.test_swap import faults, hears_on, line_of, report_of, undo
from tests.host.several import Site
from tests.support.hosts import JoinedHost
from tests.support.systems import System
from tests.support.waiting import PATIENCE, wait_until

STACK = """\
system: tests
clock: real
imports: [tests.host.parts]
hosts: HOSTS
topics:
  items: {type: handover_tests/Item}
  totals: {type: handover_tests/Item}
  config: {type: handover_tests/Item}
  adaptations: {type: regraft/AdaptationReport}
  architecture: {type: regraft/Architecture}
components:
  source: {class: 'tests.handover.parts:Source', parameters: {rate: RATE}}
  totaller: {class: 'CLASS', host: AT, parameters: {offset: 3}}
  sink: {class: 'tests.handover.parts:Sink'}
  caller: {class: 'tests.handover.parts:Caller', parameters: {rate: CALLS}}
  sleeper: {class: 'tests.host.parts:Sleeper', parameters: {where: activate, seconds: 0.5}, state: inactive}
  adaptation_manager:
    class: regraft.adaptation_manager.manager:AdaptationManager
    parameters: {journal: $RUN/journal.sqlite, answer_within: 1.0, undo_within: 3.0, start_within: 10.0}
"""
PICTURES = """\
  painter: {class: 'tests.host.moves.pictures:Painter'}
  viewer: {class: 'tests.host.moves.pictures:Viewer'}
"""
TOPICS_OF_PICTURES = """\
  pictures: {type: regraft/Image}
  seen: {type: regraft/Image}
"""
TOTALLER = "tests.handover.parts:Totaller"
NOTHING = (0, 0, 0, 0)
TO_EDGE, HOME = Move("totaller", "edge"), Move("totaller", "local")


class Moving:
    """The system, and the hosts that have joined it."""

    def __init__(
        self,
        site: Site,
        cls: str = TOTALLER,
        at: str = "local",
        hosts: str = "",
        *,
        rate: float = 1000.0,
        pictures: bool = False,
    ) -> None:
        """Start it; ``rate`` is that of the stream in Hz, calls are a fifth of it."""
        self.site = site
        self._some = int(max(20.0, rate / 10))
        stack = site.folder / "stack.yaml"
        hosts = hosts or "{edge: {lost_after: 1.0}, arm: {lost_after: 1.0}}"
        text = STACK.replace("HOSTS", hosts).replace("CLASS", cls).replace("AT,", f"{at},")
        text = text.replace("RATE", f"{rate:g}").replace("CALLS", f"{rate / 5:g}")
        if pictures:
            text = text.replace("topics:\n", f"topics:\n{TOPICS_OF_PICTURES}")
            text = text.replace(TOTALLER, "tests.host.moves.pictures:Looker")
            text += PICTURES
        stack.write_text(text)
        site.system = System(stack)

    @property
    def system(self) -> System:
        return self.site.system

    def join(self, name: str = "edge", endpoint: str = "") -> JoinedHost:
        """Have a host join."""
        return self.site.join(name, endpoint)

    def wait_flowing(self) -> None:
        """Wait until all run and totals flow."""
        for name in ("source", "totaller", "sink", "caller"):
            self.site.wait_active(name)
        self.hears_on()

    def adapt(self, *changes: Change, **more: Any) -> AdaptationReport:
        """Have it adapted."""
        request = AdaptationRequest(changes, **more)
        return self.system.client.call("adaptation_manager/adapt", request, AdaptationReport, PATIENCE)

    def undo(self, report: AdaptationReport) -> AdaptationReport:
        """Have an adaptation undone."""
        return undo(self.system, report)

    def runs(self) -> list[tuple[str, bool, ProcessStatus]]:
        """Return the runs of the totaller that have a process: host, whether it speaks, and process."""
        found = []
        for host, seen in sorted(self.system.client.hosts().items()):
            if seen.status is None or not seen.alive:
                continue
            both = [(True, p) for p in seen.processes] + [(False, p) for p in seen.status.beside]
            found += [(host, speaks, p) for speaks, p in both if p.component == "totaller" and p.pid]
        return found

    def wait_alone(self, host: str) -> ProcessStatus:
        """Wait until one run of the totaller is left, on this host."""

        def alone() -> bool:
            runs = self.runs()
            return [(at, speaks) for at, speaks, _ in runs] == [(host, True)] and (
                runs[0][2].state is ProcessState.RUNNING
            )

        wait_until(alone, f"one run of the totaller, on {host}")
        return self.runs()[0][2]

    def check(self, *, calls: bool = True) -> None:
        """Check that nothing was lost, doubled, disordered or wrong, and that every call was answered once.

        Where the totaller was not there from the start, there were ``calls`` that had nobody to answer them.
        """
        hears_on(self.system, self._some)
        found = faults(self.system)
        assert found == NOTHING, f"lost, doubled, disordered, wrong: {found}"
        if not calls:
            return
        asked = self.system.client.call("asked", Ask(), Asked, PATIENCE)
        if (asked.failed, asked.miscounted, asked.strange) != (0, 0, 0):
            self.forget_calls()
            raise AssertionError(asked)
        assert asked.answered > 0

    def forget_calls(self) -> None:
        """Have the caller count from now on: a run that was its successor, and came to nothing, has called, too."""
        self.system.client.call("asked", Ask(1), Asked, PATIENCE)

    def hears_on(self) -> None:
        """Wait until more totals have come."""
        hears_on(self.system, self._some)

    def ended(self, report: AdaptationReport) -> AdaptationReport:
        """Return the line of an adaptation once it has ended."""
        return line_of(self.system, report)


__all__ = ["HOME", "NOTHING", "TO_EDGE", "Ask", "Item", "Moving", "Report", "report_of"]
