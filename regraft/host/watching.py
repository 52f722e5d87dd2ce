"""Looks after a host's processes: has those killed that hang, and those that use more than they may."""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence

from bus_schema.model.architecture import ComponentSpec, Limits
from regraft.host.memory_use import MemoryUse
from regraft.host.silence import Silence
from regraft.host.voice import Voice
from regraft.host.ward import Ward
from regraft.host.zygote import Zygote

LOOK_EVERY = 0.05
"""Seconds between two looks at what each process does."""
SAY_WHERE_WITHIN = 0.1
"""Seconds that a hung process has to write into its log where it hangs, before it is killed by force."""


class Watching:
    """Judges processes, look by look. Times are monotonic seconds."""

    def __init__(self, voice: Voice, zygote: Zygote) -> None:
        """Nobody is expected to give signs of life yet."""
        self._silence = Silence()
        self._memory = MemoryUse(zygote.pid)
        self._voice = voice
        self._zygote = zygote

    def expect(self, ward: Ward, allowance: float, now: float) -> None:
        """Expect heartbeats of a run from now on; it may be silent for ``allowance`` seconds."""
        self._silence.watch(ward.run, ward.pid, allowance, now)

    def beat(self, ward: Ward, now: float) -> None:
        """Take a heartbeat."""
        self._silence.beat(ward.run, now)

    def forget(self, ward: Ward) -> None:
        """Expect nothing of a run any more."""
        self._silence.forget(ward.run)

    def judge(
        self, now: float, wards: Sequence[Ward], source: Ward | None, limits: Callable[[ComponentSpec], Limits]
    ) -> None:
        """Kill what hangs or uses too much; ``source`` is the time source, which is a hub on everybody's way."""
        hung = set(self._silence.hung(now, source.run if source else None))
        stalled = set(self._silence.stalled())
        for ward in wards:
            if ward.run in hung:
                self._end_hung(ward, now)
            elif ward.run in stalled:
                name = ward.spec.name
                text = f"{name} gives no sign of life: it waits for a disk or a device, and cannot be interrupted"
                self._voice.event("component.stalled", name, text, incarnation=ward.incarnation)
        self._judge_memory(now, wards, limits)

    def _end_hung(self, ward: Ward, now: float) -> None:
        name = ward.spec.name
        ward.why_killed = "its loop hung, so it was killed" if ward.seen else "it never said a word, so it was killed"
        account = self._silence.account(ward.run)
        self._silence.forget(ward.run)
        self._voice.event("component.hung", name, f"{name} gives no sign of life: {ward.why_killed} ({account})")
        self._zygote.signal(ward.pid, signal.SIGABRT)
        ward.kill_at = now + SAY_WHERE_WITHIN

    def _judge_memory(self, now: float, wards: Sequence[Ward], limits: Callable[[ComponentSpec], Limits]) -> None:
        limited = {ward.run: (ward, limits(ward.spec).memory) for ward in wards if ward.pid}
        allowed = {run: (ward.pid, memory) for run, (ward, memory) in limited.items() if memory is not None}
        for run, used in self._memory.over(now, allowed).items():
            self._end_over_limit(limited[run][0], used, allowed[run][1])

    def _end_over_limit(self, ward: Ward, used: float, allowed: float) -> None:
        name = ward.spec.name
        if not ward.why_killed and not ward.stopping:
            ward.why_killed = f"it used {used:.1f} MiB of memory and may use {allowed:.1f} MiB, so it was killed"
            text = f"{name} uses {used:.1f} MiB of memory, its limit is {allowed:.1f} MiB: it is killed"
            details = {"incarnation": ward.incarnation, "used": used, "allowed": allowed}
            self._voice.event("component.over_limit", name, text, **details)
        self._silence.forget(ward.run)
        self._zygote.signal(ward.pid, signal.SIGKILL)
