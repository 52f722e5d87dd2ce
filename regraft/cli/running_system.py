"""Reaching a running system."""

from __future__ import annotations

import getpass
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import typer

from regraft import run_directory
from regraft.bus.interface import Bus
from regraft.bus.zenoh_bus import open_bus
from regraft.cli.outcomes import Unreachable
from regraft.cli.terminal.options import chosen_system
from regraft.cli.terminal.output import complain
from regraft.cli.topology import Topology, topology
from regraft.client import Client, NoSuchComponent
from regraft.client.sending import Sender
from regraft.component.errors import CallFailed
from regraft.run_directory import RunInfo


@dataclass
class Reached:
    """A running system, and the means to see and ask it."""

    info: RunInfo
    bus: Bus
    client: Client

    @cached_property
    def known(self) -> Topology:
        """Components and their connections, asked for once; raises Unreachable, ClientError.

        A line on standard error names each component that is left out.
        """
        found = topology(self.client)
        for why in found.silent.values():
            complain(f"{why}: it is left out")
        return found

    @contextmanager
    def needing(self, component: str) -> Iterator[None]:
        """Have a block ask a component of the system; raises BadInput for an unknown one.

        One that is known and has no process now, as that of an absent host, is Unreachable in the block.
        """
        self.known.component(component)
        try:
            yield
        except NoSuchComponent:
            raise Unreachable(no_process(component)) from None

    def check(self) -> None:
        """Raise Unreachable once the system has ended: its hub does not come back."""
        if _has_ended(self.info):
            raise Unreachable(f"{self.info.system} has ended")

    def put(self, key: str, payload: bytes, encoding: str) -> None:
        """Put one message; raises BusError."""
        sender = Sender(self.bus, f"{self.client.name}-put")
        try:
            sender.put_payload(key, payload, encoding)
        finally:
            sender.close()


def no_process(component: str) -> str:
    """Return that a component of the system has no process."""
    return f"component {component!r} has no process now; see 'regraft ps'"


def find(ctx: typer.Context, system: str | None) -> RunInfo:
    """Return the system that is meant; raises NotRunning."""
    return run_directory.find(chosen_system(ctx, system))


@contextmanager
def reached(ctx: typer.Context, system: str | None) -> Iterator[Reached]:
    """Join the system that is meant while the block runs; raises NotRunning, BusError."""
    with joined(find(ctx, system)) as there:
        yield there


@contextmanager
def joined(info: RunInfo) -> Iterator[Reached]:
    """Join a system while the block runs; raises BusError.

    A request in the block that nobody answers any more, as the system has ended, raises Unreachable.
    """
    bus = open_bus(info.hub_for_tools, lockstep=info.simulated)
    with Client(bus, info.system, owns_bus=True, has_ended=lambda: _has_ended(info)) as client:
        there = Reached(info, bus, client)
        try:
            yield there
        except CallFailed as error:
            if error.answer is None:
                there.check()
            raise


def _has_ended(info: RunInfo) -> bool:
    return not run_directory.continues(info)


def user() -> str:
    """Return who sits at this command line, for the journal."""
    try:
        return f"command line, {getpass.getuser()}"
    except (KeyError, OSError):
        return "command line"


def plain_info(info: RunInfo) -> dict[str, Any]:
    """Return what is known of a running system as plain data, but for its secret."""
    return {name: getattr(info, name) for name in RunInfo.__dataclass_fields__ if name != "secret"}
