"""``regraft run``: one component alone, for trying it out."""

from __future__ import annotations

import logging
import os
import re
import secrets
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from bus_schema.annotations import PlainValue
from bus_schema.keys import component_name, system_name, topic_name
from bus_schema.suggestions import instead_of
from regraft import rundir
from regraft.assignment import Assignment
from regraft.cli.group import BadInput
from regraft.cli.options import chosen_system
from regraft.cli.output import say
from regraft.cli.reach import joined
from regraft.cli.values import assignment
from regraft.component import Component, declared, describe
from regraft.launch import free_endpoint
from regraft.parameters import ParameterSet
from regraft.process import load_class, run_component
from regraft.rundir import RunInfo
from regraft.stack.classes import look_in
from regraft.stack.components import with_absolute_paths
from regraft.stepped.source import TimeSource


def run(
    ctx: typer.Context,
    component: Annotated[str, typer.Argument(metavar="MODULE:CLASS", help="Where the component's class is.")],
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="PARAMETER=VALUE", help="Set a parameter; may be repeated."),
    ] = None,
    name: Annotated[
        str | None, typer.Option("--name", metavar="NAME", help="The component's name; by default its class's.")
    ] = None,
    connections: Annotated[
        list[str] | None,
        typer.Option("--connect", metavar="PORT=TOPIC", help="Connect a port to a topic; may be repeated."),
    ] = None,
    join: Annotated[
        str | None, typer.Option("--join", metavar="SYSTEM", help="Join a running system instead of being one.")
    ] = None,
    system: Annotated[
        str | None, typer.Option("--system", metavar="NAME", help="The system's name; by default the component's.")
    ] = None,
) -> None:
    """Run one component without a stack, until Ctrl-C; whoever asks may set its parameters and states."""
    look_in(Path.cwd())
    cls = load_class(component)
    called = component_name(name or name_of(cls))
    parameters = _parameters(cls, settings or [])
    topics = _connections(cls, connections or [])
    _log_to_terminal()
    if join is not None:
        code = _run_joined(rundir.find(join), cls, component, called, parameters, topics)
    else:
        own = system_name(chosen_system(ctx, system) or called.replace(".", "-"))
        code = _run_alone(own, cls, component, called, parameters, topics)
    raise typer.Exit(code)


def name_of(cls: type[Component]) -> str:
    """Return the usual name of a class's component.

    >>> class MapServer(Component): ...
    >>> name_of(MapServer)
    'map_server'
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()


def _parameters(cls: type[Component], settings: list[str]) -> dict[str, PlainValue]:
    given = with_absolute_paths(describe(cls), dict(map(assignment, settings)), Path.cwd())
    ParameterSet(declared(cls).parameters).check(given, starting=True)
    return given


def _connections(cls: type[Component], connections: list[str]) -> dict[str, str]:
    ports = {**declared(cls).inputs, **declared(cls).outputs}
    found = {}
    for text in connections:
        port, equals, topic = text.partition("=")
        if not equals:
            raise BadInput(f"--connect {text}: must look like PORT=TOPIC")
        if port not in ports:
            raise BadInput(f"--connect {text}: there is no port {port!r}; {instead_of(port, ports)}")
        found[port] = topic_name(topic)
    return found


def _log_to_terminal() -> None:
    form = "%(asctime)s %(levelname)s %(name)s: %(message)s"
    logging.basicConfig(level=logging.INFO, format=form, stream=sys.stderr)


def _run_alone(
    system: str,
    cls: type[Component],
    path: str,
    name: str,
    parameters: dict[str, PlainValue],
    topics: dict[str, str],
) -> int:
    """Be a system of one component, with a hub of its own."""
    simulated = issubclass(cls, TimeSource)
    endpoint = free_endpoint()
    with ExitStack() as undone:
        undone.enter_context(rundir.lock(system))
        undone.callback(rundir.forget_info, system)
        cls.preload()
        rundir.write_info(RunInfo(system, secrets.token_hex(8), os.getpid(), endpoint, path, simulated))
        say(f"{name} runs alone as system {system}; see 'regraft ps'; Ctrl-C ends it")
        sys.stdout.flush()
        return run_component(
            Assignment(
                system,
                name,
                path,
                parameters=parameters,
                connections=topics,
                simulated=simulated,
                listen=(endpoint,),
            )
        )


def _run_joined(
    info: RunInfo,
    cls: type[Component],
    path: str,
    name: str,
    parameters: dict[str, PlainValue],
    topics: dict[str, str],
) -> int:
    """Be one more component of a running system, which no host and no manager looks after."""
    with joined(info) as there:
        if name in there.client.components():
            raise BadInput(f"{info.system} has a component {name!r} already: choose another --name")
    cls.preload()
    say(f"{name} joins system {info.system}; Ctrl-C ends it")
    sys.stdout.flush()
    return run_component(
        Assignment(
            info.system,
            name,
            path,
            parameters=parameters,
            connections=topics,
            simulated=info.simulated,
            connect=(info.endpoint,),
        )
    )
