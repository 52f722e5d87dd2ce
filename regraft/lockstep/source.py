"""A source of simulated time: the component that makes the world continue, with the coordinator in its process."""

from __future__ import annotations

import time
from abc import abstractmethod
from dataclasses import dataclass, replace

from regraft.bus_schema.model.lifecycle import State
from regraft.component.component import Component
from regraft.component.parameters import Parameter
from regraft.lockstep.coordinator import Coordinator
from regraft.runtime.core.clock import SteppedClock
from regraft.runtime.loop import reach
from regraft.runtime.runtime import Runtime

MEMBERS_TIMEOUT = 30.0
"""Seconds that a run's first tick waits for the members in the stack, after a restart for the living ones."""
MEMBERS_BACK_TIMEOUT = 2.0
"""The same after a restart of the source for members without a sign of life: they may be gone for good."""
LATE_AT_MOST = 1.0
"""Seconds that a paced run may fall behind the wall clock before it stops trying to catch up."""
SPEED_OVER = 1.0
LOOK_INTERVAL = 0.05
"""Seconds between looks at who joins or wants a slot while time is still."""


class TimeSource(Component):
    """A component that advances simulated time, tick by tick."""

    removal_forbidden = "simulated time needs it"
    is_time_source = True

    tick_rate = Parameter(
        20.0, "world ticks per simulated second", minimum=1.0, maximum=1000.0, unit="Hz", read_only=True
    )
    speed = Parameter("real", "pace: as the wall clock, or as fast as possible", choices=("real", "max"))

    @abstractmethod
    def advance(self, tick: int, seconds: float) -> None:
        """Advance the world by ``seconds`` to the end of tick number ``tick``, and publish what its sensors see."""


@dataclass(slots=True)
class _Pace:
    """Where the wall clock should be."""

    started: float
    simulated: float

    def wall_for(self, simulated: float) -> float:
        return self.started + (simulated - self.simulated)


class SourceLoop:
    """Runs a time source and the coordinator, on one thread."""

    def __init__(self, runtime: Runtime, clock: SteppedClock, source: TimeSource) -> None:
        self._runtime = runtime
        self._clock = clock
        self._source = source
        self._coordinator: Coordinator | None = None
        self._speed_mark = (0.0, 0)
        self._first_tick = 0.0

    def run(self) -> None:
        """Run until the component is finalized."""
        runtime = self._runtime
        runtime.declare()
        reach(runtime, State.INACTIVE)
        period = round(1e9 / self._source.tick_rate)
        coordinator = self._coordinator = Coordinator(runtime, period)
        reach(runtime, runtime.assignment.state)
        coordinator.moment.time = self._clock.now()
        coordinator.declare()
        try:
            self._wait_for_members(coordinator)
            self._tick_until_finalized(coordinator, period)
        finally:
            coordinator.close()

    def _wait_for_members(self, coordinator: Coordinator) -> None:
        again = self._runtime.assignment.incarnation > 1
        without_sign = MEMBERS_BACK_TIMEOUT if again else MEMBERS_TIMEOUT
        coordinator.wait_for(self._runtime.assignment.members, MEMBERS_TIMEOUT, without_sign)
        coordinator.take_in()
        coordinator.run_tick(lambda: None)
        coordinator.run_slots()

    def _tick_until_finalized(self, coordinator: Coordinator, period: int) -> None:
        end = self._runtime.assignment.duration
        pace = self._begin_pace(coordinator)
        self._first_tick = self._first_tick_of_the_run()
        coordinator.faults.begin(coordinator.moment.time)
        while self._runtime.state is not State.FINALIZED:
            if not self._is_active() or coordinator.is_held:
                coordinator.stand_still(LOOK_INTERVAL)
                pace = self._begin_pace(coordinator)
                continue
            if end is not None and coordinator.moment.time >= round(end * 1e9):
                self._finish(coordinator)
                return
            pace = self._keep_pace(coordinator, pace, period)
            if self._is_active():
                coordinator.faults.perform(coordinator.moment.time)
                coordinator.run_tick(lambda: self._advance(coordinator, period))
                self._measure_speed(coordinator)

    def _first_tick_of_the_run(self) -> float:
        """Return when the first incarnation began to tick, which a checkpoint passes on; without one, now.

        The monotonic clock is the same in all processes of a machine, so the time without a source counts too.
        """
        now = time.monotonic()
        checkpoint = self._runtime.assignment.checkpoint
        before = checkpoint.first_tick if checkpoint else None
        return now if before is None else min(before, now)

    def _is_active(self) -> bool:
        return self._runtime.state is State.ACTIVE

    def _advance(self, coordinator: Coordinator, period: int) -> None:
        coordinator.moment.time += period
        self._clock.advance_to(coordinator.moment.time)
        self._runtime.guarded("advance", lambda: self._source.advance(coordinator.moment.tick, period / 1e9))
        if not self._runtime.failing:  # the checkpoint before is worth more than that of what has failed
            self._promise_checkpoint()

    def _promise_checkpoint(self) -> None:
        """Have a checkpoint of this moment taken and put while the others work, before anything else changes the world.

        It is put before anything of the next tick is: a run that continues from it repeats this moment at the most.
        """
        runtime, checkpoints = self._runtime, self._runtime.checkpoints

        def publish() -> None:
            checkpoints.publish_taken(replace(checkpoints.snapshot(), first_tick=self._first_tick))

        if checkpoints.keeps_state:
            runtime.writers.deferred.append(lambda: runtime.guarded("checkpoint", publish))

    def _begin_pace(self, coordinator: Coordinator) -> _Pace:
        now = time.monotonic()
        self._speed_mark = (now, coordinator.moment.time)
        return _Pace(now, coordinator.moment.time / 1e9)

    def _keep_pace(self, coordinator: Coordinator, pace: _Pace, period: int) -> _Pace:
        if self._source.speed == "max":
            coordinator.idle_until(time.monotonic())
            return _Pace(time.monotonic(), coordinator.moment.time / 1e9)
        due = pace.wall_for((coordinator.moment.time + period) / 1e9)
        coordinator.idle_until(due)
        if time.monotonic() - due > LATE_AT_MOST:
            return self._begin_pace(coordinator)
        return pace

    def _measure_speed(self, coordinator: Coordinator) -> None:
        since, simulated = self._speed_mark
        now = time.monotonic()
        coordinator.report.wall = now - self._first_tick
        if now - since >= SPEED_OVER:
            coordinator.report.speed = (coordinator.moment.time - simulated) / 1e9 / (now - since)
            self._speed_mark = (now, coordinator.moment.time)

    def _finish(self, coordinator: Coordinator) -> None:
        """The run has ended: time is still, and everybody may still be asked."""
        while self._runtime.state is not State.FINALIZED:
            coordinator.tell_time(finished=True)
            coordinator.stand_still(LOOK_INTERVAL)
