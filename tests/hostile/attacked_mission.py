"""A mission that ticks ten times a second while hostile input is sent, and what it was like for the mission."""

from __future__ import annotations

import json
import threading
from bisect import bisect
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Final

import httpx

from regraft.services.bt_executor.observing.recording import Step, steps
from tests.hostile.conftest import HEAD, Start
from tests.hostile.mission_requests import Doors, send_one
from tests.hostile.rest import Rest
from tests.support.waiting import PATIENCE, wait_until

PERIOD: Final = 0.1
"""Seconds from one tick of the mission to the next."""
CLIENTS: Final = 2
UNDISTURBED: Final = 20
"""Ticks that the mission is watched before anything is sent."""
MISSION: Final = """<root BTCPP_format="4" main_tree_to_execute="Main">
<BehaviorTree ID="Main"><Sequence>
  <Script code="rounds := 0"/>
  <KeepRunningUntilFailure><SubTree ID="Round" name="round" rounds="{rounds}" file="FILE"/></KeepRunningUntilFailure>
</Sequence></BehaviorTree>
<BehaviorTree ID="Round"><Sequence><Script code="rounds += 1"/><Pulse file="{file}"/></Sequence></BehaviorTree>
</root>"""
WITH_MISSION: Final = HEAD.replace("components:\n", "  mission: {type: regraft/MissionStatus}\ncomponents:\n")
FAULTS: Final = ("mission.failed", "mission.halted", "mission.swapped", "mission.loaded", "component.fault")


@dataclass
class Answers:
    """The answers to hostile inputs.

    Attributes:
        inputs: How many inputs were sent.
        statuses: Their statuses by kind of input.
        wrong: Those that a server must not give.
        unavailable: Reasons of those with status 503.
    """

    inputs: int = 0
    statuses: dict[str, Counter[str]] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)
    unavailable: Counter[str] = field(default_factory=Counter)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def note(self, kind: str, status: str, text: str) -> None:
        """Note an answer."""
        with self.lock:
            self.statuses.setdefault(kind, Counter())[status] += 1
            if status == "503":
                self.unavailable[str(json.loads(text)["detail"])[:200]] += 1
            elif status == "failed" or status.startswith("5"):
                self.wrong.append(f"{kind}: {status} {text[:500]}")

    def lines(self) -> list[str]:
        """Return a line for each kind."""
        lines = [f"{kind:24} {dict(sorted(count.items()))}" for kind, count in sorted(self.statuses.items())]
        return [*lines, *(f"503, {count} times: {reason}" for reason, count in self.unavailable.items())]


@dataclass(frozen=True, slots=True)
class Course:
    """The ticks of a mission in a stretch of time, next to the beats of a metronome in another process.

    Attributes:
        ticks: Times of the ticks.
        beats: Times of the beats.
        pulses: At each tick, the seconds of a processor that the mission's thread and its whole process had used.
    """

    ticks: tuple[float, ...]
    beats: tuple[float, ...]
    pulses: tuple[tuple[float, float], ...]

    @property
    def largest_gap(self) -> float:
        """The longest time between two ticks, in periods of the mission."""
        return max(after - before for before, after in pairwise(self.ticks)) / PERIOD

    @property
    def most_beats(self) -> int:
        """The most beats between two ticks."""
        return max(bisect(self.beats, after) - bisect(self.beats, before) for before, after in pairwise(self.ticks))

    @property
    def most_work(self) -> tuple[float, float]:
        """The most that the mission's thread, and its whole process, worked between two ticks, in periods."""
        work = [
            (own - own_before, all_ - all_before) for (own_before, all_before), (own, all_) in pairwise(self.pulses)
        ]
        return max(own for own, _ in work) / PERIOD, max(all_ for _, all_ in work) / PERIOD


class AttackedMission:
    """A stack with a mission, a gateway, and a metronome, which tells a slow mission from a slow machine."""

    def __init__(self, rest: Rest, folder: Path) -> None:
        self.rest = rest
        self.answers = Answers()
        self._record, self._beats, self._pulses = (folder / name for name in ("run.jsonl", "beats.txt", "pulse.txt"))
        self._run = rest.system.wait_running("bt_executor")
        wait_until(lambda: self._record.exists() and len(self.steps()) > UNDISTURBED, "the mission to tick")
        self._begin = self.steps()[-1].stamp
        self._events = len(rest.system.events)

    def steps(self) -> list[Step]:
        """Return what is recorded of the mission."""
        return list(steps(self._record))

    def attack(self, count: int, seed: int, begin: int = 0) -> None:
        """Send hostile inputs, each drawn from the seed and its number, from several clients at once."""
        numbers = range(begin, begin + count)
        with ThreadPoolExecutor(CLIENTS) as clients:
            parts = [clients.submit(self._send, numbers[first::CLIENTS], seed) for first in range(CLIENTS)]
            for part in parts:
                part.result()

    def _send(self, numbers: range, seed: int) -> None:
        base = f"http://127.0.0.1:{self.rest.port}/api/v1"
        with httpx.Client(base_url=base, timeout=PATIENCE, verify=False) as client:
            doors = Doors(client, self.rest.system.client, self.answers.note)
            for number in numbers:
                send_one(doors, Random(f"{seed} {number}"))
                with self.answers.lock:
                    self.answers.inputs += 1

    def courses(self) -> tuple[Course, Course]:
        """Return the course before the attack, and the one since."""
        ticks = [step.stamp for step in self.steps() if step.tick]
        beats = tuple(map(float, self._beats.read_text().split()))
        pulses = tuple((float(own), float(all_)) for own, all_ in map(str.split, self._pulses.read_text().splitlines()))
        tick, beat = bisect(ticks, self._begin), bisect(beats, self._begin)
        before = Course(tuple(ticks[:tick]), beats[:beat], pulses[:tick])
        return before, Course(tuple(ticks[tick - 1 :]), beats[beat:], pulses[tick - 1 :])

    def check(self) -> None:
        """Make sure that it is the same run of the same mission, which has not missed a tick, and runs."""
        run = self.rest.system.processes()["bt_executor"]
        assert (run.pid, run.incarnation) == (self._run.pid, self._run.incarnation)
        found = self.steps()
        assert [step.tree for step in found if not step.tick] == ["Main"]
        assert [step.tick for step in found if step.tick] == list(range(1, len(found)))
        events = self.rest.system.events[self._events :]
        faults = [f"{event.kind} {event.text}" for event in events if event.kind in FAULTS]
        assert faults == [], faults
        now = self.rest.get("/mission").json()
        assert (now["state"], now["tree"], now["error"]) == ("running", "Main", "")
        assert found[-1].tick <= now["blackboard"]["rounds"]
        wait_until(lambda: self.rest.get("/mission").json()["ticks"] > now["ticks"] + 3, "the mission to continue")
        _, course = self.courses()
        # The processors may be crowded with others' work; what the mission's own thread does is not changed by that.
        assert course.most_work[0] < 1.0, course.most_work

    def lines(self) -> list[str]:
        """Return the numbers, for reading."""
        before, since = self.courses()
        words = ((before, "undisturbed"), (since, "attacked"))
        return [
            *self.answers.lines(),
            f"{self.answers.inputs} inputs, {sum(c.total() for c in self.answers.statuses.values())} requests",
            *(
                f"{name}: {len(course.ticks)} ticks, {len(course.beats)} beats, "
                f"largest gap {course.largest_gap:.2f} periods, {course.most_beats} beats; "
                f"most work between two ticks: {course.most_work[0]:.2f} periods of its thread, "
                f"{course.most_work[1]:.2f} of its process"
                for course, name in words
            ),
        ]


@contextmanager
def attacked_mission(start: Start, folder: Path) -> Iterator[AttackedMission]:
    """Run the mission, until the block ends."""
    (folder / "mission.xml").write_text(MISSION.replace("FILE", f"{folder}/pulse.txt"))
    nodes = "nodes: 'tests.hostile.pace:Pulse'"
    executor = f"parameters: {{mission: {folder}/mission.xml, record: {folder}/run.jsonl, {nodes}}}"
    components = (
        f"  bt_executor: {{class: 'regraft.services.bt_executor.executor:Executor', {executor}}}\n"
        f"  metronome: {{class: 'tests.hostile.pace:Metronome', parameters: {{file: {folder}/beats.txt}}}}\n"
    )
    with Rest(partial(start, head=WITH_MISSION), components) as rest:
        yield AttackedMission(rest, folder)
