"""Keeps all members in step: rounds within a tick until it is quiet, exclusive slots, joining, wiring, leaving.

It lives in the time source's process, works on its thread, and counts the source as a member.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from functools import partial

from regraft.bus.interface import Closable, Presence, Sample
from regraft.bus.known_runs import Run, run_of
from regraft.bus_schema.messages.management.system import SystemFaultKind
from regraft.bus_schema.messages.protocol.clock import (
    Ack,
    CauseCode,
    ClockMember,
    Join,
    MarkerAck,
    SlotRequest,
    StepKind,
)
from regraft.bus_schema.model.lifecycle import State
from regraft.lockstep.clock_publisher import ClockPublisher
from regraft.lockstep.exclusive_slot import hold_slot
from regraft.lockstep.fault_schedule import FaultSchedule
from regraft.lockstep.joining.absence import AbsentRuns
from regraft.lockstep.joining.admission import Admission
from regraft.lockstep.joining.gathering import wait_for_members
from regraft.lockstep.joining.join_requests import JoinRequests
from regraft.lockstep.markers import Markers
from regraft.lockstep.member import NOT_COME
from regraft.lockstep.membership import Membership, MemberState
from regraft.lockstep.run_report import RunReport
from regraft.lockstep.scheduled_members import ScheduledMembers
from regraft.lockstep.source_inbox import SourceInbox
from regraft.lockstep.step_dispatch import STEP_BOUND, Moment, StepDispatcher
from regraft.lockstep.system_relay import SystemRelay
from regraft.lockstep.wiring import ReportedWiring, note_wanted
from regraft.patience import Patience
from regraft.runtime.runtime import Runtime

MAX_ROUNDS = 32
RUN_ENDED = "its run has ended"


class Coordinator:
    """The coordinator's side of the protocol, for one run of the time source."""

    def __init__(self, runtime: Runtime, period: int) -> None:
        """Keep time in ticks of ``period`` nanoseconds."""
        publisher = ClockPublisher(runtime.bus)
        self.membership = Membership()
        self.moment = Moment(period)
        self._runtime = runtime
        self._keys = runtime.keys
        self._inbox = SourceInbox(runtime)
        self._dispatcher = StepDispatcher(self.membership, self.moment, publisher, runtime, self._inbox)
        self.report = RunReport(publisher, self._keys.clock("time"))
        self._name = runtime.assignment.name
        if runtime.assignment.incarnation > 1:
            self.report.note(CauseCode.SOURCE_RESTARTED, self._name, 0, "the source of time is another run")
        self._admission = Admission(runtime, self._admit, self._release, self._succeed)
        self._joins = JoinRequests(self.membership, self._admission.may_join)
        self._ended_in_slot: set[Run] = set()
        self._absent = AbsentRuns()
        self._declared: list[Closable] = []
        self._wiring = ReportedWiring(runtime)
        self._system = SystemRelay(runtime, self.membership, self.moment)
        self._markers = Markers(runtime, self.membership, self._inbox, self._have_marked, self._system.connected)
        scheduled = ScheduledMembers(runtime, self.membership, self._joins, self._system, self._forget)
        self.faults = FaultSchedule(
            runtime, scheduled, self._inbox.pump, partial(self._fault, CauseCode.SCHEDULE_MISSED)
        )
        self.local = self.membership.add(self._name, runtime.assignment.incarnation, self._wiring.all(), None)

    def declare(self) -> None:
        """Listen to members, and be found by them."""
        runtime = self._runtime
        takers: dict[str, Callable[[Sample], None]] = {
            "join": self._inbox.opening(Join, self._joins.take),
            "ack": self._inbox.opening(Ack, self._dispatcher.take_ack),
            "marker_ack": self._inbox.opening(MarkerAck, self._markers.take_ack),
            "slot_request": self._inbox.opening(SlotRequest, self._take_slot_request),
        }
        runtime.direct.update({self._keys.clock(part): take for part, take in takers.items()})
        runtime.marker_listeners.append(self._markers.saw)
        if runtime.assignment.step_socket:
            self._dispatcher.links.listen(runtime.assignment.step_socket)
        self._declared = [
            *self._admission.declare(),
            *(runtime.bus.subscribe(self._keys.clock(part), runtime.inbox.put) for part in takers),
            runtime.bus.watch(self._keys.alive("*", "*"), lambda p: runtime.post(lambda: self._presence(p))),
            runtime.bus.announce(self._keys.clock(f"alive/{runtime.assignment.incarnation}")),
        ]

    # --- requests of members ---

    def close(self) -> None:
        """Give no steps any more."""
        self._dispatcher.links.close()

    def _take_slot_request(self, request: SlotRequest) -> None:
        member = self.membership.members.get(request.member)
        if member is not None and member.incarnation == request.incarnation:
            member.outside |= self._strangers(request.outside)

    def _strangers(self, sources: tuple[str, ...]) -> set[str]:
        return {name for name in sources if name not in self.membership.members and name not in self._joins.pending}

    def _presence(self, presence: Presence) -> None:
        run = run_of(presence.key)
        if run is None or run[0] == self._name:
            return
        if presence.present:
            self._joins.appeared(run)
            if self._absent.came_back(run):
                self._dispatcher.send_again(run[0])
            return
        waited = self._joins.vanished(run)
        if self._dispatcher.links.may_be_elsewhere(*run):
            self._absent.went(run)
        else:
            self._ended(*run)
        for join in waited:
            self._joins.take(join)

    def _end_absent(self) -> None:
        for run in self._absent.take_ended():
            self._ended(*run)

    def _ended(self, name: str, incarnation: int) -> None:
        member = self.membership.members.get(name)
        if member is not None and member.incarnation == incarnation and not self.faults.expects((name, incarnation)):
            if self._admission.is_open and not self._dispatcher.awaits(name):
                self._ended_in_slot.add((name, incarnation))  # another run may be about to continue in its place
            else:
                self._drop(name, CauseCode.LEFT, RUN_ENDED)

    def _drop(self, name: str, code: CauseCode, why: str) -> None:
        self._system.ended(name, self.membership.members[name].incarnation, SystemFaultKind.DIED, why)
        self.membership.remove(name)
        self._forget(name)
        self.report.note(code, name, self.moment.time, why)
        self.report.dropped.append(name)
        self._runtime.reporter.event("clock.dropped", f"{name} left the clock: {why}; this run is not reproducible")

    def _forget(self, name: str) -> None:
        self._dispatcher.forget(name)
        self._markers.forget(name)

    # --- joining and wiring ---

    def _admit(self, run: ClockMember) -> bool:
        """Take a run in now if it has asked to join; in a slot, where it makes no difference when it asked."""
        if self._joins.asks(run):
            self._welcome(run.member)
        member = self.membership.members.get(run.member)
        return member is not None and member.incarnation == run.incarnation

    def _release(self, run: ClockMember) -> bool:
        """Let a run go in order: nothing of what it did is lost, and the run stays reproducible."""
        self._joins.drop(run)
        member = self.membership.members.get(run.member)
        if member is not None and member is not self.local and member.incarnation == run.incarnation:
            self.membership.leave(run.member)
            self._forget(run.member)
            self._system.left(run.member)
        return False

    def _succeed(self, run: ClockMember) -> bool:
        """Have another run of a member continue in its place, once it lives; all that is wired stays so."""
        member = self.membership.members.get(run.member)
        if member is None:  # it was dropped, since the run before was frozen without a successor
            self._joins.expect(run)
            return self._admit(run)
        if run.incarnation > member.incarnation and self._joins.lives(run):
            self._joins.pending.pop(run.member, None)
            member.succeed(run.incarnation)
        return member.incarnation == run.incarnation

    def take_in(self) -> None:
        """Take in who asked to join, and wire them; between ticks only."""
        self._end_absent()
        while self._joins.pending:
            self._welcome(min(self._joins.pending))
        self.wire()

    def _welcome(self, name: str) -> None:
        join = self._joins.pending.pop(name)
        if name in self.membership.members:
            self._drop(name, CauseCode.REPLACED, "it was replaced by a newer run")
        self.membership.add(name, join.incarnation, join.wiring, join.next_wake)
        if self.local.incarnation > 1:  # who has lived under the source before this one knows how late it was
            self.moment.time = max(self.moment.time, join.time)
        self._exchange({name: StepKind.WELCOME})

    def wire(self) -> None:
        """Have every connection confirmed."""
        self._system.open()
        news = self._wiring.news()
        if news is not None:
            self.membership.rewire(self.local, news)
        for key, writer, reader in self._markers.confirm_all():
            why = f"it never saw a marker of {writer} on {key}"
            self.report.note(CauseCode.UNWIRED, reader, self.moment.time, why)

    def _have_marked(self, keys: dict[str, set[str]]) -> None:
        self._exchange(dict.fromkeys(keys, StepKind.MARK), keys)
        self._end_absent()

    # --- ticks ---

    def run_tick(self, advance: Callable[[], None]) -> None:
        """Let the source advance, then run rounds and slots until the tick is quiet."""
        self.take_in()
        if (wanted := self.membership.news_of_wanted(self.local, self.local)) is not None:
            note_wanted(self._runtime, wanted[0])
        self._runtime.writers.defers = True
        advance()
        self.local.due = True
        for member in self.membership.members.values():
            member.due = member.due or (member.next_wake is not None and member.next_wake <= self.moment.time)
        self.run_rounds(first=True)
        self.run_slots()
        self.tell_time()

    def run_rounds(self, *, first: bool = False) -> None:
        """Give steps to all who have something to do, round by round, until nobody has."""
        self._take_local_output()
        for number in range(0 if first else 1, MAX_ROUNDS):
            due = [name for name in sorted(self.membership.members) if self.membership.members[name].due]
            others = [name for name in due if name != self._name]
            self._dispatcher.send(dict.fromkeys(others, StepKind.STEP), round_number=number)
            self._runtime.writers.defers = False  # the others are at work by now
            self._runtime.writers.flush()
            if not due:
                return
            if self._name in due:
                self._step_local(number)
            self._collect(others)
            self._take_local_output()
            self.wire()
        text = f"tick {self.moment.tick} was not quiet after {MAX_ROUNDS} rounds"
        self._runtime.reporter.event("clock.unquiet", text)

    def _step_local(self, number: int) -> None:
        runtime, member = self._runtime, self.local
        runtime.inbound.forget_sources(member.take_gone())
        runtime.end_goals_of(member.take_ended())
        frontier = member.begin_step()
        if not self._inbox.wait_for_inputs(frontier, Patience(STEP_BOUND)):
            missing = runtime.inbound.missing(frontier)
            self._fault(CauseCode.MESSAGES_LOST, self._name, f"{NOT_COME}: {missing}")
        runtime.inbound.release(frontier)
        runtime.work()
        if number == 0:
            runtime.fire()
        self._inbox.settle()
        if error := runtime.fetching.take_error():
            self._fault(CauseCode.MESSAGES_LOST, self._name, error)
        member.next_wake = runtime.timers.next_due()

    def _take_local_output(self) -> None:
        self._system.publish()
        published = dict(self._runtime.writers.advanced)
        self._runtime.writers.advanced.clear()
        self.membership.advance(self.local, published)

    # --- slots ---

    def run_slots(self) -> None:
        """Grant exclusive slots, one at a time, until nobody wants one."""
        for _ in range(MAX_ROUNDS):
            wanting = self._wanting()
            if not wanting:
                return
            member = wanting[0]
            member.wants_slot = False
            touched = self._grant(member)
            present = [name for name in touched if name in self.membership.members and name != self._name]
            self._exchange(dict.fromkeys(present, StepKind.REPORT))
            self.wire()
            self.run_rounds()

    def _wanting(self) -> list[MemberState]:
        self.local.outside = self._strangers(self._runtime.inbound.outsiders())
        self.local.wants_slot = self._runtime.slots.wanted
        wanting = [member for member in self.membership.members.values() if member.wants_slot or member.outside]
        return sorted(wanting, key=lambda member: member.name)

    def _grant(self, member: MemberState) -> tuple[str, ...]:
        """Let a member hold the slot until it gives it back; returns whose wiring or timing may have changed.

        That is anybody's if the holder died in it.
        """
        outside = tuple(sorted(member.outside))
        if member is self.local:
            return hold_slot(self._runtime, outside, self._inbox.pump_and_work, self._inbox.settle)
        member.outside.clear()
        self._dispatcher.send({member.name: StepKind.SLOT}, outside=outside)
        with self._admission.opened():
            touched = self._collect([member.name], bounded=False)
        self._drop_ended()
        return touched if self.membership.members.get(member.name) is member else tuple(sorted(self.membership.members))

    def _drop_ended(self) -> None:
        ended, self._ended_in_slot = self._ended_in_slot, set()
        for name, incarnation in sorted(ended):
            member = self.membership.members.get(name)
            if member is not None and member.incarnation == incarnation:
                self._drop(name, CauseCode.LEFT, RUN_ENDED)

    # --- steps and their results ---

    def _exchange(self, kinds: dict[str, StepKind], marks: dict[str, set[str]] | None = None) -> None:
        self._dispatcher.send(kinds, marks=marks)
        self._collect(list(kinds))

    def _collect(self, names: list[str], *, bounded: bool = True) -> tuple[str, ...]:
        """Wait for members to finish their steps and take the results; returns whom they touched."""
        acks, silent = self._dispatcher.collect(
            names, bounded=bounded, ended=lambda: self._runtime.state is State.FINALIZED, late=self._while_late
        )
        for name in silent:
            self._drop(name, CauseCode.SILENT, f"no acknowledgement within {STEP_BOUND:g} s")
        for ack in acks:
            self._take_result(ack)
        return tuple(name for ack in acks for name in ack.touched)

    def _while_late(self, waiting: tuple[str, ...]) -> None:
        self._end_absent()
        self.tell_time(waiting)

    def _take_result(self, ack: Ack) -> None:
        member = self.membership.members[ack.member]
        member.next_wake = ack.next_wake
        member.wants_slot = ack.wants_slot
        member.holds_time = ack.holds_time
        if ack.error:
            self._fault(CauseCode.MESSAGES_LOST, ack.member, ack.error)
        self._runtime.inbound.arrive_early(ack.samples)
        self._system.take(ack.news)
        self.membership.advance(member, ack.published)
        if ack.wiring is not None:
            self.membership.rewire(member, ack.wiring)

    def _fault(self, code: CauseCode, member: str, error: str) -> None:
        self.report.note(code, member, self.moment.time, error)
        self._runtime.reporter.event("clock.fault", f"{member}, tick {self.moment.tick}: {error}")

    # --- between ticks ---

    def idle_until(self, deadline: float) -> None:
        """Answer control queries and grant slots until the wall clock reaches ``deadline`` (monotonic seconds)."""
        self._inbox.pump(0.0)
        while self._inbox.pump_until(lambda: bool(self._wanting()), deadline):
            self.run_slots()

    @property
    def is_held(self) -> bool:
        """Whether a member has time stand still."""
        return self._runtime.holds_time or any(member.holds_time for member in self.membership.members.values())

    def stand_still(self, seconds: float) -> None:
        """Let no time pass for ``seconds`` of wall-clock time, but take joins and grant slots."""
        self.idle_until(time.monotonic() + seconds)
        self.take_in()

    def wait_for(self, names: Iterable[str], seconds: float, without_sign: float) -> None:
        """Wait at most ``seconds`` until all of ``names`` have joined, ``without_sign`` for those that show no token.

        Time starts without the others, and that is reported.
        """
        missing = wait_for_members(
            set(names),
            lambda: self._joins.pending.keys() | self.membership.members,
            self._runtime,
            self._inbox.pump,
            Patience(seconds),
            Patience(without_sign),
        )
        if missing:
            for name in missing:
                self.report.note(CauseCode.NOT_JOINED, name, self.moment.time, "it has not joined in time")
            self.report.dropped += missing
            text = f"time starts without {', '.join(missing)}: not joined in time; this run is not reproducible"
            self._runtime.reporter.event("clock.incomplete", text)

    def tell_time(self, waiting: tuple[str, ...] = (), *, finished: bool = False) -> None:
        """Put the time for onlookers, now and then, and once more at the end."""
        self.report.tell(self.moment.tick, self.moment.time, self.membership.members, waiting, finished=finished)
