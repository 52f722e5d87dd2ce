"""Runs a host that joins the first host of a system, which may be on another machine; leaves nothing behind."""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from regraft import run_directory
from regraft.bus.interface import Bus, BusError
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys, system_name
from regraft.bus_schema.messages.protocol.joining import JoinedSystem, JoinHost
from regraft.bus_schema.model.hosts.offers import NO_OFFER, HostOffer
from regraft.host.joined_host import JoinedHost
from regraft.host.joining.early_query import asked_by_a_child
from regraft.host.plan import HostPlan, module_folders, moved
from regraft.host.supervisor import ZYGOTE_GONE
from regraft.host.zygote.zygote import Zygote, start_zygote
from regraft.process.scheduling import work_in_batches
from regraft.process.shutdown import ShutdownRequest
from regraft.process.trial.trial_import import Notice
from regraft.security.unreachable import explained
from regraft.stack.classes import look_in
from regraft.stack.installed import packages
from regraft.system import capacity
from regraft.system.first_host import ANSWER_TIMEOUT, RETRY_INTERVAL, CannotJoin, FirstHost, NothingThere, read_answer
from regraft.system.launch import PUMP, free_endpoint, prepare_process

WAIT_FOR_LOSS = 30.0
"""Seconds that a name is waited for whose last host may still run."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """The system to join, and the name to join by.

    ``system`` None takes the one that is there; ``stack_folder`` None looks for it.
    ``offer`` is what the host offers in addition to what the stack names.
    """

    endpoints: Endpoints
    name: str
    system: str | None = None
    stack_folder: Path | None = None
    offer: HostOffer = NO_OFFER


@dataclass(slots=True)
class Joined:
    """A host that has joined; ``notices`` are lines for the person who started it."""

    host: JoinedHost
    bus: Bus
    system: str
    endpoint: str
    notices: tuple[str, ...] = ()


def run_guest(
    wanted: Wanted, step: Callable[[Joined], None] = lambda _: None, notice: Notice = lambda _: None
) -> JoinedHost:
    """Join, and run until SIGINT, SIGTERM, SIGHUP or the system's end; returns the host, whose processes have ended.

    ``notice`` gets a line about a module whose import takes long.

    Raises:
        KeyboardInterrupt: one of the signals came before it had joined.
        BusError: nobody listens there.
        NothingThere: nobody answers there.
        CannotJoin: the first host refuses, or a file of the host's components is not here.
        AlreadyRunning, NoRoom: the host's folder is in use, or cannot be written.
        TooMany: this machine cannot hold the host's components.
        NoPort: it has no port for the host's hub.
        NoSuchClass: a class of the host's components cannot be had here.
    """
    ending = ShutdownRequest()
    ending.hear_signals()
    try:
        with ending.interrupting():
            first = _look(wanted)
    except BusError as error:
        raise explained(error, wanted.endpoints) from None
    system = first.architecture.system
    # Components and questions about classes run in it: a relative one would be looked for below itself.
    stack_folder = wanted.stack_folder.resolve() if wanted.stack_folder else stack_folder_of(first)
    for each in module_folders(first, stack_folder):
        look_in(each)
    folder = run_directory.folder(f"{system}@{wanted.name}")
    held = run_directory.lock(folder.name)
    try:
        mine = {name: spec for name, spec in first.architecture.components.items() if spec.host == wanted.name}
        capacity.check(mine.values(), joined=True)
        with ending.interrupting():
            notices = prepare_process(mine.values(), notice)
        if first.architecture.simulated:
            work_in_batches()
        zygote = start_zygote()
        try:
            plan = HostPlan(
                name=wanted.name,
                architecture=first.architecture,
                folder=folder,
                stack_folder=stack_folder,
                run=first.run,
                endpoint=free_endpoint(),
                secret=wanted.endpoints.secret,
            )
            _check_files(plan.as_joined(first))
            return _run(wanted, plan, zygote, ending, notices, step)
        finally:
            zygote.close()
    finally:
        run_directory.unlock(held)


def _look(wanted: Wanted) -> JoinedSystem:
    """Ask what there is, without joining yet: a while may pass until all is imported."""
    key = Keys(system_name(wanted.system) if wanted.system else "*").host("*", "join")
    payload = codec.encode(JoinHost(wanted.name, "", offer=wanted.offer))
    deadline = time.monotonic() + WAIT_FOR_LOSS
    while True:
        answer = asked_by_a_child(wanted.endpoints, key, payload, ANSWER_TIMEOUT)
        if answer is None:
            where = ", ".join(wanted.endpoints.connect)
            named = f" named {wanted.system!r}" if wanted.system else ""
            raise NothingThere(f"no system{named} that can be joined answers at {where}")
        joined = read_answer(answer, JoinedSystem)
        if isinstance(joined, JoinedSystem):
            return _checked(joined, wanted)
        if time.monotonic() > deadline:
            raise CannotJoin(joined)
        time.sleep(RETRY_INTERVAL)


def _checked(first: JoinedSystem, wanted: Wanted) -> JoinedSystem:
    if first.by_certificate and wanted.endpoints.tls is None:
        named = first.architecture.system
        raise CannotJoin(
            f"system {named!r} takes in hosts by their certificates: join its tls/ endpoint, with --tls FOLDER"
        )
    return first


def stack_folder_of(first: JoinedSystem) -> Path:
    """Return where this machine has the stack: the first host's folder, an installed one, or the current folder."""
    there, here = first.stack_folder, packages()
    # Another user's home, where this one may not look, is as good as absent.
    if os.path.isdir(there):
        return Path(there)
    installed = {folder: here[name] for name, folder in first.packages.items() if name in here}
    found = str(moved({"": there}, installed)[""])
    return Path(found) if os.path.isdir(found) else Path.cwd()


def _check_files(plan: HostPlan) -> None:
    problems = [f"host {plan.name!r}: {place}: {problem}" for place, problem in plan.missing_files()]
    if problems:
        raise CannotJoin("\n".join(problems))


def _run(
    wanted: Wanted,
    plan: HostPlan,
    zygote: Zygote,
    ending: ShutdownRequest,
    notices: tuple[str, ...],
    step: Callable[[Joined], None],
) -> JoinedHost:
    architecture = plan.architecture
    endpoints = replace(wanted.endpoints, listen=(plan.endpoint,), router=True)
    bus = open_bus(endpoints, lockstep=architecture.simulated)
    try:
        instance = secrets.token_hex(8)
        first_host = FirstHost(bus, Keys(architecture.system), ending)
        seal = first_host.prove(wanted.endpoints.tls, plan.name, instance)
        asked = JoinHost(plan.name, instance, pid=os.getpid(), offer=wanted.offer)
        first, asked_at = first_host.join(asked, seal)
        host = JoinedHost(plan.as_joined(first), bus, zygote, first, asked_at, instance, seal, wanted.offer)
        joined = Joined(host, bus, architecture.system, plan.endpoint, notices)
        host.start()
        try:
            while not (ending.wanted or host.ended or host.over):
                host.pump(PUMP)
                step(joined)
            if host.ended:
                host.over = ZYGOTE_GONE
        except BaseException:
            host.failed = True
            raise
        finally:
            host.end()
        return host
    finally:
        bus.close()
