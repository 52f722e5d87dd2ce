"""Components that hang, die and break."""

from __future__ import annotations

import ctypes
import gc
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from regraft import Component, Input, Output, Parameter, every, service
from regraft.bus_schema.annotations import Count, PlainValue
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.description import Resources
from tests.handover.parts import Item, Sink, Totaller


@message("host_tests/Tick")
@dataclass(frozen=True, slots=True)
class Tick:
    """How often something has ticked."""

    count: Count


class Ticker(Component):
    """Ticks, remembers its count over a crash, and says it in its log."""

    ticks = Output(Tick)
    step = Parameter(1, minimum=1, maximum=100)
    checkpoint_every = 0.05

    def __init__(self) -> None:
        self.count = 0

    def on_activate(self) -> None:
        print("ticker begins at", self.count)

    @every(hz=50)
    def tick(self) -> None:
        self.count += self.step
        self.ticks.publish(Tick(self.count))

    def snapshot(self) -> dict[str, int]:
        return {"count": self.count}

    def restore(self, state: dict[str, int]) -> None:
        self.count = state["count"]


class Ending(Ticker):
    """Ticks for two seconds, and leaves a file when it has done so."""

    done = Parameter("", "where the file shall be", unit="path")

    @every(hz=50)
    def tick(self) -> None:
        if self.count < 100:
            super().tick()
        else:
            Path(self.done).touch()


class Plodding(Ticker):
    """Takes its time for everything, and does not say so."""

    def on_configure(self) -> None:
        time.sleep(1.0)

    @service("plod")
    def plod(self, tick: Tick) -> Tick:
        time.sleep(1.0)
        return tick


class Leaper(Ticker):
    """Another class that goes on from a ticker's state."""


class Moody(Component):
    """Does what it is asked to, however bad."""

    @service("hang")
    def hang(self, tick: Tick) -> Tick:
        time.sleep(3600)
        return tick

    @service("spin")
    def spin(self, tick: Tick) -> Tick:
        while True:
            tick = Tick(tick.count)

    @service("exit")
    def exit(self, tick: Tick) -> Tick:
        os._exit(tick.count)

    @service("stop")
    def stop(self, tick: Tick) -> Tick:
        os.kill(os.getpid(), signal.SIGSTOP)
        return tick


class Deaf(Component):
    """Hangs, and takes no notice of the signal that asks where."""

    @service("ignore")
    def ignore(self, tick: Tick) -> Tick:
        signal.signal(signal.SIGABRT, signal.SIG_IGN)
        time.sleep(3600)
        return tick


class Tidy(Component):
    """Counts what a collection of garbage looks through."""

    @service("garbage")
    def garbage(self, tick: Tick) -> Tick:
        return Tick(len(gc.get_objects()))


class Stalling(Component):
    """Waits in a way that the kernel does not interrupt, as who waits for a disk does."""

    @service("stall")
    def stall(self, milliseconds: Tick) -> Tick:
        """Start a child whose output finds its reader that late; until then, this process stands in the kernel."""
        with tempfile.TemporaryDirectory() as folder:
            pipe = f"{folder}/pipe"
            os.mkfifo(pipe)
            reader = subprocess.Popen(["sh", "-c", f"sleep {milliseconds.count / 1000}; exec <{pipe}"])
            child = os.posix_spawn(
                "/bin/true", ["true"], {}, file_actions=[(os.POSIX_SPAWN_OPEN, 1, pipe, os.O_WRONLY, 0)]
            )
            os.waitpid(child, 0)
            reader.wait()
        return milliseconds


class Deep(Component):
    """Sinks into C code for a while, as it says it may, and keeps the interpreter to itself."""

    ticks = Input(Tick)
    handler_timeout = 10.0

    def on_configure(self) -> None:
        self.counts: list[int] = []

    @ticks.handler
    def count(self, tick: Tick) -> None:
        self.counts.append(tick.count)

    @service("sink")
    def sink(self, milliseconds: Tick) -> Tick:
        ctypes.PyDLL(None).usleep(milliseconds.count * 1000)
        return milliseconds

    @service("heard")
    def heard(self, _: Tick) -> Tick:
        return Tick(len(self.counts))

    @service("missing")
    def missing(self, _: Tick) -> Tick:
        """Say how many ticks are missing between the first and the last that came."""
        return Tick(self.counts[-1] - self.counts[0] + 1 - len(self.counts))


class Stillborn(Component):
    """Never gets up."""

    def on_configure(self) -> None:
        sys.stderr.write("no life in me\n")
        os._exit(3)


class Stubborn(Component):
    """Does not want to leave."""

    def on_shutdown(self) -> None:
        time.sleep(3600)


class Sleeper(Component):
    """Falls asleep where it is told to."""

    where = Parameter("nowhere", choices=("nowhere", "configure", "activate"))
    seconds = Parameter(3600.0)

    def on_configure(self) -> None:
        if self.where == "configure":
            time.sleep(self.seconds)

    def on_activate(self) -> None:
        if self.where == "activate":
            time.sleep(self.seconds)


class StillbornTotaller(Totaller):
    """Never gets up to succeed anybody."""

    def on_configure(self) -> None:
        sys.stderr.write("no life in me\n")
        os._exit(3)


class SleepyTotaller(Totaller):
    """Falls asleep for good when it is to get ready."""

    def on_configure(self) -> None:
        time.sleep(3600.0)


class SlowTotaller(Totaller):
    """Takes its time to get ready."""

    def on_configure(self) -> None:
        super().on_configure()
        print("gets ready", flush=True)
        time.sleep(0.25)


class SlowTaking(Totaller):
    """Takes its time to go on."""

    def on_activate(self) -> None:
        print("takes its time", flush=True)
        time.sleep(0.25)


class StillbornSink(Sink):
    """Never gets up."""

    def on_configure(self) -> None:
        os._exit(3)


class LameSink(Sink):
    """Cannot be activated."""

    def on_activate(self) -> None:
        raise RuntimeError("cannot get up")


class Pulse(Component):
    """Counts a thousand times a second."""

    pulses = Output(Tick)

    def __init__(self) -> None:
        self.count = 0

    @every(hz=1000)
    def beat(self) -> None:
        self.count += 1
        self.pulses.publish(Tick(self.count))


class Listener(Component):
    """Says how many pulses it has had, and how many came out of their order."""

    pulses = Input(Tick)

    def __init__(self) -> None:
        self.heard = self.wrong = self.last = 0

    @pulses.handler
    def take(self, tick: Tick) -> None:
        self.wrong += bool(self.last) and tick.count != self.last + 1
        self.last = tick.count
        self.heard += 1

    def snapshot(self) -> dict[str, int]:
        return {"heard": self.heard, "wrong": self.wrong}


class Counting(Component):
    """Says how far the ticks have come."""

    ticks = Input(Tick)

    def __init__(self) -> None:
        self.last = self.wrong = 0

    @ticks.handler
    def take(self, tick: Tick) -> None:
        self.wrong += tick.count <= self.last
        self.last = tick.count

    def snapshot(self) -> dict[str, int]:
        return {"last": self.last, "wrong": self.wrong}


class DyingTotaller(Totaller):
    """Keeps checkpoints, and dies again and again, a while after one with three calls."""

    checkpoint_every = 0.02

    def __init__(self) -> None:
        self.left = 100
        self.is_kept = False

    @Totaller.items.handler
    def add(self, item: Item) -> None:
        super().add(item)
        self.left -= self.is_kept
        if not self.left:
            os._exit(1)

    def snapshot(self) -> PlainValue:
        self.is_kept = self.calls >= 3
        return super().snapshot()


class LoopingTotaller(Totaller):
    """Dies as soon as it is active."""

    def on_activate(self) -> None:
        os._exit(1)


class Holder(Totaller):
    """Needs a device for itself."""

    resources = Resources(memory=8.0, devices=("lidar",))


class KeepingSink(Sink):
    """Hands over what it has noticed."""

    KEPT = ("last", "total", "heard", "lost", "doubled", "disordered", "wrong", "gap", "before")

    def snapshot(self) -> PlainValue:
        return {name: getattr(self, name) for name in self.KEPT}

    def restore(self, state: PlainValue) -> None:
        for name in self.KEPT:
            setattr(self, name, state[name])


class Greedy(Ticker):
    """Takes memory and files as it is told to, and keeps them."""

    def on_configure(self) -> None:
        self.kept: list[object] = []

    @service("eat")
    def eat(self, mebibytes: Tick) -> Tick:
        self.kept.append(b"x" * (mebibytes.count * 2**20))
        return mebibytes

    @service("open")
    def open(self, files: Tick) -> Tick:
        self.kept += [os.open(os.devnull, os.O_RDONLY) for _ in range(files.count)]
        return files

    @service("files")
    def files(self, _: Tick) -> Tick:
        """Say how many files may be open."""
        return Tick(resource.getrlimit(resource.RLIMIT_NOFILE)[0])


class Swelling(Ticker):
    """Needs much memory to get ready."""

    def on_configure(self) -> None:
        self.kept = b"x" * (300 * 2**20)
        time.sleep(1.0)


class Fast(Ticker):
    """Computes on an accelerator."""

    resources = Resources(cpu=0.1, memory=20.0, devices=("fpga",), amounts={"accelerator_area": 0.5})


class Thrifty(Ticker):
    """Needs a little of the same."""

    ticks = Output(Tick, topic="pulses")
    resources = Resources(cpu=0.1, memory=20.0, amounts={"accelerator_area": 0.25})
