"""``regraft run``: one component alone, for trying it out."""

from __future__ import annotations

import logging
import os
import re
import secrets
import signal
import sys
import threading
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from regraft import run_directory
from regraft.bus_schema.annotations import Connections, PlainValue
from regraft.bus_schema.keys import component_name, system_name, topic_name
from regraft.bus_schema.model.robots.scopes import scope_of
from regraft.bus_schema.suggestions import instead_of
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import joined
from regraft.cli.terminal.options import JsonOption, chosen_system
from regraft.cli.terminal.output import complain, say, show_json
from regraft.cli.terminal.values import assignments
from regraft.component.component import Component, describe, parameter_set
from regraft.lockstep.source import TimeSource
from regraft.process.main import load_class, run_component
from regraft.process.shutdown import ShutdownRequest
from regraft.process.trial.trial_import import check_classes
from regraft.run_directory import RunInfo
from regraft.runtime.core.assignment import Assignment
from regraft.security.system_secret import fresh
from regraft.stack.classes import look_in
from regraft.stack.files import file_problems
from regraft.stack.relative_paths import with_absolute_paths
from regraft.system.launch import free_endpoint

LOOK_INTERVAL = 0.25


def run(
    ctx: typer.Context,
    component: Annotated[str, typer.Argument(metavar="MODULE:CLASS", help="The class of the component.")],
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="PARAMETER=VALUE", help="Set a parameter; may be repeated."),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option("--name", metavar="NAME", help="The component's name; by default its class's."),
    ] = None,
    connections: Annotated[
        list[str] | None,
        typer.Option(
            "--connect", metavar="PORT=TOPIC", help="Connect a port to a topic, null for none; may be repeated."
        ),
    ] = None,
    join: Annotated[
        str | None,
        typer.Option("--join", metavar="SYSTEM", help="Join a running system instead of being one."),
    ] = None,
    system: Annotated[
        str | None,
        typer.Option("--system", metavar="NAME", help="The system's name; by default the component's."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run one component without a stack, until Ctrl-C; anybody may set its parameters and states."""
    look_in(Path.cwd())
    ending = ShutdownRequest()
    ending.hear_signals()
    with ending.interrupting():
        check_classes([component], complain)
        cls = load_class(component)
        called = component_name(name or name_of(cls))
        there = run_directory.find(join) if join is not None else None
        usual = called.replace(".", "-")
        parameters = _parameters(cls, settings or [])
        own = Assignment(
            there.system if there else system_name(chosen_system(ctx, system) or usual),
            called,
            component,
            parameters=parameters,
            connections=_connections(cls, parameters, connections or []),
        )
        _prepare(cls)
    _log_to_terminal()
    if there:
        raise typer.Exit(_run_joined(own, there, ending, as_json))
    raise typer.Exit(_run_alone(own, ending, as_json, keeps_time=issubclass(cls, TimeSource)))


def name_of(cls: type[Component]) -> str:
    """Return the usual name of a class's component.

    >>> class MapServer(Component): ...
    >>> name_of(MapServer)
    'map_server'
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()


def _parameters(cls: type[Component], settings: list[str]) -> dict[str, PlainValue]:
    given = with_absolute_paths(describe(cls), assignments(settings, "--set "), Path.cwd())
    parameter_set(cls, given)
    for name, problem in file_problems(describe(cls), given):
        raise BadInput(f"--set {name}={problem}")
    return given


def _connections(cls: type[Component], parameters: dict[str, PlainValue], connections: list[str]) -> Connections:
    ports = [port.name for port in describe(cls, parameters).ports]
    found: Connections = {}
    for text in connections:
        port, equals, topic = text.partition("=")
        if not equals:
            raise BadInput(f"--connect {text}: must look like PORT=TOPIC")
        if port not in ports:
            raise BadInput(f"--connect {text}: there is no port {port!r}; {instead_of(port, ports)}")
        found[port] = None if topic == "null" else topic_name(topic)
    return found


def _log_to_terminal() -> None:
    form = "%(asctime)s %(levelname)s %(name)s: %(message)s"
    logging.basicConfig(level=logging.INFO, format=form, stream=sys.stderr)


def _run_alone(own: Assignment, ending: ShutdownRequest, as_json: bool, *, keeps_time: bool) -> int:
    """Be a system of one component, with a hub of its own."""
    alone = replace(own, simulated=keeps_time, listen_endpoints=(free_endpoint(),), secret=fresh())
    system = own.system
    run_id = secrets.token_hex(8)
    info = RunInfo(
        system, run_id, os.getpid(), alone.listen_endpoints[0], own.cls, alone.simulated, secret=alone.secret
    )

    def on_bus() -> None:
        run_directory.write_info(info)
        _announce(own, f"{own.name} runs alone as system {system}; see 'regraft ps'; Ctrl-C ends it", as_json)

    with ExitStack() as undone:
        undone.enter_context(run_directory.lock(system))
        undone.callback(run_directory.forget_info, system)
        return run_component(alone, ending, on_bus)


def _run_joined(own: Assignment, info: RunInfo, ending: ShutdownRequest, as_json: bool) -> int:
    """Be one more component of a running system, which no host and no manager looks after."""
    with ending.interrupting(), joined(info) as there:
        if own.name in {*there.known.components, *there.known.silent}:
            raise BadInput(f"{info.system} has a component {own.name!r} already: choose another --name")
        scope = scope_of(own.name, there.known.scopes) if "." in own.name else ""
    threading.Thread(target=_end_after, args=(info,), daemon=True).start()
    endpoints = (info.endpoint,)
    joining = replace(own, simulated=info.simulated, connect_endpoints=endpoints, secret=info.secret, scope=scope)
    text = f"{own.name} joins system {info.system}; Ctrl-C ends it"
    return run_component(joining, ending, lambda: _announce(own, text, as_json))


def _prepare(cls: type[Component]) -> None:
    notice = cls.preload()
    if notice:
        complain(notice)


def _announce(own: Assignment, text: str, as_json: bool) -> None:
    if as_json:
        show_json({"system": own.system, "component": own.name, "pid": os.getpid()}, compact=True)
    else:
        say(text)
    sys.stdout.flush()


def _end_after(info: RunInfo) -> None:
    """End this process once the run of the system has ended: its hub does not come back.

    Its process may stay as a zombie, or another one may get its number. The lock of its folder is looked at from time
    to time: a wait in the kernel would end with holding it.
    """
    while run_directory.continues(info):
        time.sleep(LOOK_INTERVAL)
    os.kill(os.getpid(), signal.SIGTERM)
