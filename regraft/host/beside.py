"""Second runs of components: successors that wait for their turn, and incumbents that are frozen."""

from __future__ import annotations

import time

from bus_schema.messages.host import LetSpeak, ProcessState, StartSuccessor
from regraft.assignment import Succession
from regraft.host.past import PastRuns
from regraft.host.restarts import RestartHistory
from regraft.host.voice import UnknownComponent
from regraft.host.ward import Ward

ALONE_WITHIN = 5.0
"""Seconds after which a component that has ended is restarted although another run stands beside it: by then, whoever
started that should have decided which of them goes on.
"""


class Beside:
    """The runs (``wards``, one for each component at the most) beside those that speak for their components.

    The run that speaks may be on another host.
    """

    def __init__(self, speaking: dict[str, Ward], past: PastRuns) -> None:
        """There are none; ``speaking`` and ``past`` are the host's."""
        self.wards: dict[str, Ward] = {}
        self._speaking = speaking
        self._past = past
        self._highest: dict[str, int] = {}

    def next_number(self, ward: Ward) -> int:
        """Return an incarnation that no run of the component has had."""
        name = ward.spec.name
        self._highest[name] = max(self._highest.get(name, 0), ward.incarnation) + 1
        return self._highest[name]

    def highest(self, name: str) -> int:
        """Return the highest incarnation that is known of a component, or kept for a run elsewhere."""
        return max(self._highest.get(name, 0), *(ward.incarnation for ward in self._runs(name)), 0)

    def add(self, asked: StartSuccessor) -> Ward:
        """Return a new successor that is to be started; raises UnknownComponent."""
        name = asked.spec.name
        if asked.incarnation:
            return self._add_alone(asked)
        incumbent = self._incumbent(asked)
        spec = asked.spec.described_as(incumbent.spec)
        history = RestartHistory(spec.restart, total=incumbent.history.total)
        succession = Succession(incumbent.incarnation, asked.with_state)
        checkpoint = incumbent.checkpoint if asked.with_state else b""
        self.wards[name] = Ward(spec, history, succeeds=succession, checkpoint=checkpoint)
        return self.wards[name]

    def _add_alone(self, asked: StartSuccessor) -> Ward:
        """Return the successor of a run on another host."""
        spec, name = asked.spec, asked.spec.name
        if name in self._speaking or self.has_process(name):
            raise UnknownComponent(f"{name}: there is a run of it on this host already")
        checkpoint = self._past.checkpoint(name) if asked.with_state else b""
        # The incumbent answers under what it was started as, whatever it is called by now.
        succession = Succession(asked.incumbent, asked.with_state)
        ward = Ward(spec, RestartHistory(spec.restart), succeeds=succession, checkpoint=checkpoint)
        ward.incarnation = asked.incarnation - 1
        self.wards[name] = ward
        return ward

    def expect(self, asked: StartSuccessor) -> None:
        """Keep an incarnation for a successor on another host, and leave a run that ends to it; UnknownComponent."""
        incumbent = self._incumbent(asked)
        incumbent.awaited = True
        self.next_number(incumbent)

    def _incumbent(self, asked: StartSuccessor) -> Ward:
        name = asked.spec.name
        incumbent = self._speaking.get(name)
        if incumbent is None or incumbent.begun != asked.incumbent or not incumbent.has_process:
            raise UnknownComponent(f"{name}: there is no run {asked.incumbent} of it to succeed")
        if self.has_process(name):
            raise UnknownComponent(f"{name}: another run of it stands beside it already")
        return incumbent

    def stands(self, ward: Ward) -> bool:
        """Tell whether a run stands beside its component."""
        return self.wards.get(ward.spec.name) is ward

    def has_process(self, name: str) -> bool:
        """Tell whether another run stands beside a component."""
        return name in self.wards and self.wards[name].has_process

    def awaits(self, ward: Ward) -> bool:
        """Tell whether another run may go on for a component if this one ends."""
        return ward.awaited or self.has_process(ward.spec.name)

    def forget(self, ward: Ward) -> None:
        """Know nothing of a run that has ended, but its number and checkpoint if the component is elsewhere now."""
        name = ward.spec.name
        del self.wards[name]
        if name not in self._speaking:
            self._past.note(name, ward.incarnation, ward.checkpoint)

    def step_aside(self, name: str) -> None:
        """Have the run that speaks for a component here stand beside one on another host."""
        ward = self._speaking.pop(name, None)
        if ward is None:
            return
        ward.restart_by, ward.start_at, ward.awaited = None, None, False
        if ward.has_process:
            self.wards[name] = ward
        else:
            self._past.note(name, ward.incarnation, ward.checkpoint)

    def restart_if_alone(self, ward: Ward, now: float) -> None:
        """Have a component that has ended restarted, if nobody stands beside it any more, or nobody has decided."""
        if ward.restart_by is not None and (now > ward.restart_by or not self.awaits(ward)):
            ward.restart_by, ward.start_at, ward.state = None, now, ProcessState.WAITING

    def _runs(self, name: str) -> list[Ward]:
        return [wards[name] for wards in (self._speaking, self.wards) if name in wards]

    def begun_as(self, name: str, incarnation: int) -> Ward | None:
        """Return the run of a component that was started as ``incarnation``."""
        return next((ward for ward in self._runs(name) if ward.begun == incarnation), None)

    def called(self, name: str, incarnation: int) -> Ward | None:
        """Return the run of a component that speaks as ``incarnation``."""
        return next((ward for ward in self._runs(name) if ward.is_called(incarnation)), None)

    def let_speak(self, asked: LetSpeak) -> None:
        """Have another run speak for a component, or the same as another incarnation; raises UnknownComponent."""
        name = asked.component
        ward = self.begun_as(name, asked.begun)
        if ward is None:
            raise UnknownComponent(f"{name}: there is no run that was started as {asked.begun}")
        if asked.above is not None:
            ward.rename(max(self.next_number(ward), asked.above + 1))
            self._highest[name] = ward.incarnation
        ward.awaited = False
        if not self.stands(ward):
            return
        former = self._speaking.get(name)
        self._speaking[name] = ward
        del self.wards[name]
        if former is not None:
            former.restart_by = None
            if former.has_process:
                self.wards[name] = former
        if not ward.has_process:
            ward.restart_by = time.monotonic() + ALONE_WITHIN
