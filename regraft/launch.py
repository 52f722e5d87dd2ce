"""Starts a whole system on this machine and runs its host until it ends; leaves nothing behind."""

from __future__ import annotations

import contextlib
import os
import random
import secrets
import signal
import socket
from collections.abc import Callable
from dataclasses import dataclass, replace
from types import FrameType

from bus_schema.architecture import Architecture
from regraft import rundir
from regraft.bus import Bus
from regraft.component import Component
from regraft.host.host import Host
from regraft.host.plan import HostPlan
from regraft.host.zygote import Zygote, start_zygote
from regraft.process import NoSuchClass, load_class
from regraft.stack import Problem, Stack, StackError, time_source
from regraft.stack.components import in_run_folder
from regraft.zenoh_bus import open_bus
from regraft.zenoh_config import Endpoints

PUMP = 0.05
LOCAL = "local"
PORTS = range(10_000, 20_000)
"""TCP ports of hubs: below those that the kernel gives to outgoing connections."""


@dataclass(slots=True)
class Running:
    """A system that has been started: its host, the bus, and how to reach it."""

    host: Host
    bus: Bus
    info: rundir.RunInfo
    stopping: bool = False

    def stop(self) -> None:
        """Have the system end."""
        self.stopping = True


def free_endpoint() -> str:
    """Return a loopback endpoint that is free now, and that the kernel gives to nobody meanwhile.

    Raises:
        OSError: no port is free.
    """
    for port in random.sample(PORTS, len(PORTS)):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return f"tcp/127.0.0.1:{port}"
    raise OSError(f"none of the TCP ports {PORTS[0]} to {PORTS[-1]} is free")


def run_system(
    stack: Stack, *, duration: float | None = None, step: Callable[[Running], None] = lambda _: None
) -> None:
    """Start ``stack`` and run it; ``step`` is called again and again, and ends the system with ``stop``.

    SIGINT and SIGTERM end it too. When this returns, every process has ended.

    Raises:
        StackError: the stack has components on other hosts.
        AlreadyRunning: a system of that name is running.
        NoSuchClass: a class cannot be prepared.
        NoRoom: the system's folder cannot be written.
        BusError: the hub cannot listen.
    """
    _refuse_other_hosts(stack)
    system = stack.architecture.system
    held = rundir.lock(system)
    try:
        _prepare_process(stack.architecture)
        zygote = start_zygote()
        try:
            _run(_plan(stack, duration), stack, zygote, step)
        finally:
            zygote.close()
    finally:
        rundir.forget_info(system)
        held.close()


def _refuse_other_hosts(stack: Stack) -> None:
    """Refuse what nobody would start: this version runs one machine."""
    problems = []
    for spec in stack.architecture.components.values():
        if spec.host != LOCAL:
            where = f"components.{spec.name}.host"
            what = f"{spec.host!r}: this version starts components on {LOCAL!r} alone"
            problems.append(Problem(str(stack.file), stack.lines.get(where), where, what))
    if problems:
        raise StackError(problems)


def _prepare_process(architecture: Architecture) -> None:
    """Import and prepare what the components' processes share, before the first of them is forked."""
    for path, cls in _classes(architecture).items():
        try:
            cls.preload()
        except Exception as error:
            raise NoSuchClass(f"{path!r} cannot be prepared: {type(error).__name__}: {error}") from error


def _classes(architecture: Architecture) -> dict[str, type[Component]]:
    paths = sorted({spec.cls for spec in architecture.components.values() if spec.cls})
    return {path: load_class(path) for path in paths}


def _plan(stack: Stack, duration: float | None) -> HostPlan:
    architecture = stack.architecture
    folder = rundir.folder(architecture.system)
    components = {name: in_run_folder(spec, str(folder)) for name, spec in architecture.components.items()}
    source = time_source(stack) if architecture.simulated else None
    return HostPlan(
        replace(architecture, components=components),
        folder,
        stack.file.parent,
        secrets.token_hex(8),
        free_endpoint(),
        source,
        free_endpoint() if source else "",
        stack.seed,
        duration,
    )


def _run(plan: HostPlan, stack: Stack, zygote: Zygote, step: Callable[[Running], None]) -> None:
    connect = (plan.source_endpoint,) if plan.source else ()
    bus = open_bus(Endpoints((plan.endpoint,), connect, router=True), in_step=plan.architecture.simulated)
    try:
        host = Host(plan, bus, zygote)
        info = rundir.RunInfo(
            plan.architecture.system,
            plan.run,
            os.getpid(),
            plan.endpoint,
            str(stack.file),
            plan.architecture.simulated,
        )
        running = Running(host, bus, info)
        _stop_on_signals(running)
        host.start()
        try:
            rundir.write_info(info)
            while not running.stopping and not host.ended:
                host.pump(PUMP)
                step(running)
        finally:
            host.end()
    finally:
        bus.close()


def _stop_on_signals(running: Running) -> None:
    def stop(signum: int, frame: FrameType | None) -> None:
        running.stop()

    for signum in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(signum, stop)
