"""``regraft up``: starts the system of a stack file and stays until it ends."""

from __future__ import annotations

from enum import Enum
from functools import partial
from typing import Annotated

import typer

from regraft import run_directory
from regraft.bus.interface import BusError
from regraft.bus_schema.model.hosts.hosts import LOCAL
from regraft.cli.outcomes import FAILED, BadInput
from regraft.cli.system.display import display
from regraft.cli.system.host_log import log_to_file
from regraft.cli.system.ports_free import check_ports
from regraft.cli.system.running import Run
from regraft.cli.terminal.numbers import seconds, whole
from regraft.cli.terminal.one_of import one_of
from regraft.cli.terminal.options import (
    InsecureOption,
    JsonOption,
    OverridesOption,
    ParametersOption,
    PlacesOption,
    SecretOption,
    StackArgument,
    TlsOption,
    chosen_system,
)
from regraft.cli.terminal.output import complain, say, show_json
from regraft.process.descendants import nothing_left_behind
from regraft.security import system_secret
from regraft.security.access import Guard
from regraft.stack import (
    Stack,
    check_with_classes,
    load_as_asked,
    with_faults,
    with_seed,
    with_speed,
    with_system,
)
from regraft.stack.installed import stack_file
from regraft.system.launch import run_system


class Speed(Enum):
    """The pace of simulated time."""

    REAL = "real"
    MAX = "max"


@nothing_left_behind()
def up(
    ctx: typer.Context,
    stack: StackArgument,
    overrides: OverridesOption = None,
    params: ParametersOption = None,
    places: PlacesOption = None,
    speed: Annotated[
        Speed | None, typer.Option("--speed", help="The pace of simulated time.", parser=one_of(Speed, "speed"))
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            "--for",
            metavar="SECONDS",
            parser=seconds(0.001),
            help="End after this number of seconds: of simulated time, or of the real clock once all is up.",
        ),
    ] = None,
    faults: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="'SECONDS COMPONENT KIND'",
            help="Make a component fail: kill, stop, hang, exception or slow; may be repeated.",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", metavar="N", parser=whole(0), help="The seed of everything random.")
    ] = None,
    headless: Annotated[bool, typer.Option("--headless", help="No live display, plain lines only.")] = False,
    system: Annotated[
        str | None, typer.Option("--system", metavar="NAME", help="Run it under another system name.")
    ] = None,
    listen: Annotated[
        str | None,
        typer.Option(
            "--listen", metavar="ENDPOINT", help="The endpoint where other hosts join, such as tcp/127.0.0.1:7447."
        ),
    ] = None,
    tls: TlsOption = None,
    insecure: InsecureOption = False,
    secret: SecretOption = None,
    as_json: JsonOption = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but the closing line.")] = False,
) -> None:
    """Start the system of a stack file, and show its events. Ctrl-C or the end of its time ends it.

    Exits with 0 also after Ctrl-C or 'regraft down'. Exits with 1 if a component is quarantined at the end, or if
    start-up timed out. A --secret FILE that does not exist is created.
    """
    if secret is not None:
        system_secret.make(secret)
    guard = Guard(tls, insecure, secret)
    guard.secret()
    if listen is not None:
        guard.check(listen)
        guard.tls(LOCAL)
    of_run = partial(_of_run, speed=speed, seed=seed, system=chosen_system(ctx, system))
    notice = (lambda _: None) if quiet else complain
    wanted = load_as_asked(stack_file(stack), params, overrides, places, first=of_run, notice=notice)
    wanted = with_faults(wanted, faults or [])
    # That it runs already is the better reason than that its gateway's port is in use.
    run_directory.lock(wanted.name).close()
    check_ports(wanted.architecture)
    check_with_classes(wanted)
    duration = duration if duration is not None else wanted.duration
    log_to_file(run_directory.folder(wanted.name))
    run = Run(display(headless=headless, quiet=quiet or as_json), duration)
    try:
        run_system(wanted, duration=duration, listen=listen or "", guard=guard, step=run.step)
    except BusError as error:
        raise BadInput(str(error)) from None
    finally:
        run.end()
    if run.closing is not None:
        if as_json:
            show_json(run.closing.plain())
        elif duration is not None or not quiet:
            say(run.closing.line())
    if not run.healthy:
        raise typer.Exit(FAILED)


def _of_run(stack: Stack, speed: Speed | None, seed: int | None, system: str | None) -> Stack:
    """Return the stack as options want the whole run; raises StackError."""
    if system is not None:
        stack = with_system(stack, system)
    if speed is not None:
        stack = with_speed(stack, speed.value)
    return with_seed(stack, seed) if seed is not None else stack
