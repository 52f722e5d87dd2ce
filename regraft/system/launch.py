"""Starts a whole system on this machine and runs its host until it ends; leaves nothing behind."""

from __future__ import annotations

import contextlib
import gc
import os
import random
import secrets
import socket
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from regraft import run_directory
from regraft.bus.interface import Bus
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Endpoints, Tls
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.component.component import Component
from regraft.host.joining.proof_checker import ProofChecker
from regraft.host.plan import HostPlan
from regraft.host.primary_host import PrimaryHost
from regraft.host.zygote.zygote import Zygote, start_zygote
from regraft.process.common_types import compile_common_types
from regraft.process.main import NoSuchClass, load_class
from regraft.process.modules import line_of
from regraft.process.scheduling import work_in_batches
from regraft.process.shutdown import ShutdownRequest
from regraft.process.trial.trial_import import Notice, check_classes
from regraft.process.unrepeatable import find_uses
from regraft.security.access import Guard, as_reached
from regraft.security.gatekeeper import Gatekeeper
from regraft.security.system_secret import fresh
from regraft.stack import Stack, time_source
from regraft.stack.sections.components import in_run_folder
from regraft.stack.sections.modes import modes_in_run_folder
from regraft.system import capacity

PUMP = 0.05
OPEN_TO_NOBODY = Guard()
CLOCK_SOCKET = "clock.sock"
TOOLS_SOCKET = "tools.sock"
PORTS = range(10_000, 20_000)
"""TCP ports of hubs: below those that the kernel gives to outgoing connections."""
LONGEST_SOCKET_PATH = 100
"""Bytes. The kernel takes 107, and Zenoh's lock needs some of them."""
MEANS_MORE_IN_ENDPOINTS = frozenset("?#;")


@dataclass(slots=True)
class Running:
    """A system that has been started: its host, the bus, how to reach it, and the request that it ends.

    ``notices`` are lines for the person who started it, from the preparation of the classes.
    """

    host: PrimaryHost
    bus: Bus
    info: run_directory.RunInfo
    ending: ShutdownRequest
    notices: tuple[str, ...] = ()


class NoPort(Exception):
    """This machine has no port for a hub; the text states why."""


def free_endpoint() -> str:
    """Return a loopback endpoint that is free now, and that nobody is given meanwhile; raises NoPort.

    The kernel gives it to no outgoing connection. As long as this process lives, no other one draws it here.
    """
    why = ""
    for port in random.sample(PORTS, len(PORTS)):
        name = socket.socket(socket.AF_UNIX)
        try:
            # A name in the machine's network that goes with its process: others that draw at the same time see it.
            name.bind(f"\0regraft-port-{port}")
            with socket.socket() as probe:
                probe.bind(("127.0.0.1", port))
        except OSError as error:
            name.close()
            why = (error.strerror or str(error)).lower()
        else:
            name.detach()  # open, and so taken, until the process ends
            return f"tcp/127.0.0.1:{port}"
    raise NoPort(f"no TCP port of 127.0.0.1 from {PORTS[0]} to {PORTS[-1]} is free: {why}")


def socket_in(folder: Path, name: str) -> str:
    """Return the endpoint of a Unix socket in the system's folder; empty where the path cannot be a socket's.

    Some file systems have none.
    """
    file = folder / name
    if len(os.fsencode(file)) > LONGEST_SOCKET_PATH or set(str(file)) & MEANS_MORE_IN_ENDPOINTS:
        return ""
    try:
        file.unlink(missing_ok=True)
        with socket.socket(socket.AF_UNIX) as probe:
            probe.bind(str(file))
        file.unlink()
    except OSError:
        return ""
    return f"unixsock-stream/{file}"


def run_system(
    stack: Stack,
    *,
    duration: float | None = None,
    listen: str = "",
    guard: Guard = OPEN_TO_NOBODY,
    step: Callable[[Running], None] = lambda _: None,
) -> None:
    """Start ``stack`` and run it; ``step`` is called again and again, and may want its ``ending``.

    Its hub listens at the endpoint ``listen``, empty for any free one on loopback; there other hosts join. ``guard``
    states how a link beyond loopback is kept safe.

    SIGINT, SIGTERM and SIGHUP end it too. When this returns, every process has ended.

    Raises:
        KeyboardInterrupt: one of them came before the system was started.
        AlreadyRunning: a system of that name is running.
        TooMany: this machine cannot hold the components.
        NoPort: it has no port for the hub.
        NoSuchClass: a class cannot be prepared.
        NoRoom: the system's folder cannot be written.
        BusError: the hub cannot listen.
        NotSecure: the hub would be open to strangers.
    """
    if listen:
        guard.check(listen)
    ending = ShutdownRequest()
    ending.hear_signals()
    system = stack.architecture.system
    held = run_directory.lock(system)
    try:
        mine = [spec for spec in stack.architecture.components.values() if spec.host == LOCAL]
        capacity.check(mine)
        with ending.interrupting():
            notices = prepare_process(mine)
        if stack.architecture.simulated:
            work_in_batches()
        zygote = start_zygote()
        try:
            plan = _plan(stack, duration, guard.secret() or fresh())
            with _gate(listen, guard.tls(LOCAL) if listen else None, plan) as gate:
                _run(plan, listen, gate, stack, zygote, ending, notices, step)
        finally:
            zygote.close()
    finally:
        run_directory.forget_info(system)
        run_directory.unlock(held)


def prepare_process(specs: Iterable[ComponentSpec], notice: Notice = lambda _: None) -> tuple[str, ...]:
    """Import and prepare what the components' processes share, before the first is forked; raises NoSuchClass.

    Returns the classes' remarks about this machine, each line once. ``notice`` gets a line about a module whose import
    takes long.

    It is left out of every collection of garbage from then on. To look at it all takes a tenth of a second, in which no
    thread of the process runs. It would also write to pages of memory that the processes share.
    """
    said: dict[str, None] = {}
    for path, cls in _classes(specs, notice).items():
        try:
            told = cls.preload()
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise NoSuchClass(f"{path!r} cannot be prepared: {type(error).__name__}: {line_of(error)}") from error
        if told:
            said[told] = None
    find_uses()
    compile_common_types()
    gc.freeze()
    return tuple(said)


def _classes(specs: Iterable[ComponentSpec], notice: Notice) -> dict[str, type[Component]]:
    paths = sorted({spec.cls for spec in specs if spec.cls})
    check_classes(paths, notice)
    return {path: load_class(path) for path in paths}


def _plan(stack: Stack, duration: float | None, secret: str) -> HostPlan:
    architecture = stack.architecture
    folder = run_directory.folder(architecture.system)
    components = {name: in_run_folder(spec, str(folder)) for name, spec in architecture.components.items()}
    modes = modes_in_run_folder(architecture.modes, str(folder))
    source = time_source(stack) if architecture.simulated else None
    return HostPlan(
        architecture=replace(architecture, components=components, modes=modes),
        folder=folder,
        stack_folder=stack.folder,
        folders=stack.folders,
        run=secrets.token_hex(8),
        endpoint=free_endpoint(),
        secret=secret,
        source=source,
        # A Unix socket makes a run about a twentieth faster than TCP does.
        source_endpoint=(socket_in(folder, CLOCK_SOCKET) or free_endpoint()) if source else "",
        # The hub's own Unix sockets are those of tools: see Endpoints.
        source_door=free_endpoint() if source else "",
        step_socket=str(folder / run_directory.STEP_SOCKET) if source else "",
        seed=stack.seed,
        duration=duration,
        references=stack.references,
        faults=stack.faults,
        tools_endpoint=socket_in(folder, TOOLS_SOCKET),
    )


@contextlib.contextmanager
def _gate(listen: str, tls: Tls | None, plan: HostPlan) -> Iterator[Gatekeeper | None]:
    """Keep the gate by which other hosts come over TLS, if there is to be one."""
    if tls is None or not listen.startswith("tls/"):
        yield None
        return
    gate = Gatekeeper(listen, plan.endpoint, tls)
    try:
        yield gate
    finally:
        gate.close()


def _run(
    plan: HostPlan,
    listen: str,
    gate: Gatekeeper | None,
    stack: Stack,
    zygote: Zygote,
    ending: ShutdownRequest,
    notices: tuple[str, ...],
    step: Callable[[Running], None],
) -> None:
    connect = (plan.source_door,) if plan.source else ()
    doors = (plan.endpoint, listen) if listen and gate is None else (plan.endpoint,)
    endpoints = Endpoints(doors, connect, router=True, tools=plan.tools_endpoint, secret=plan.secret)
    bus = open_bus(endpoints, lockstep=plan.architecture.simulated)
    try:
        ending.check()
        host = PrimaryHost(plan, bus, zygote, ProofChecker(gate.tls if gate else None))
        info = run_directory.RunInfo(
            plan.architecture.system,
            plan.run,
            os.getpid(),
            plan.endpoint,
            str(stack.file),
            plan.architecture.simulated,
            join=as_reached(listen or plan.endpoint),
            secret=plan.secret,
            tools_endpoint=plan.tools_endpoint,
        )
        running = Running(host, bus, info, ending, notices)
        host.start()
        try:
            run_directory.write_info(info)
            while not ending.wanted and not host.ended:
                if gate is not None:
                    gate.keep()
                host.pump(PUMP)
                step(running)
        finally:
            host.end()
    finally:
        bus.close()
