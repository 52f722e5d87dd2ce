"""``regraft host``: lists the hosts of a system, or is one more of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from regraft import run_directory
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.encoding import codec
from regraft.cli.outcomes import BadInput, Unreachable
from regraft.cli.running_system import Reached, reached
from regraft.cli.system.host_log import log_to_file
from regraft.cli.system.host_offer import read_offer
from regraft.cli.system.host_resources import show_resources
from regraft.cli.terminal.options import (
    InsecureOption,
    JsonOption,
    SecretOption,
    SystemOption,
    TlsOption,
    chosen_system,
)
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.client.seen import HostSeen
from regraft.process.descendants import nothing_left_behind
from regraft.security.access import Guard
from regraft.system.join import Joined, Wanted, run_guest


def host(
    ctx: typer.Context,
    join: Annotated[
        str | None,
        typer.Option("--join", metavar="ENDPOINT", help="Join the running system as a host, until Ctrl-C."),
    ] = None,
    name: Annotated[
        str | None, typer.Option("--name", metavar="NAME", help="With --join: the name to be a host under.")
    ] = None,
    resources: Annotated[
        bool, typer.Option("--resources", help="Show what each host offers, and what its components need and take.")
    ] = False,
    offer: Annotated[
        list[str] | None,
        typer.Option(
            "--offer",
            metavar="NAME=AMOUNT|DEVICE",
            help="With --join: what this host offers besides what the stack names, such as power=20, memory='2 GB' or "
            "fpga; may be given several times.",
        ),
    ] = None,
    stack_folder: Annotated[
        Path | None,
        typer.Option(
            "--stack-folder",
            metavar="FOLDER",
            file_okay=False,
            exists=True,
            help="With --join: the folder of the stack's files on this machine; by default that of the first host.",
        ),
    ] = None,
    tls: TlsOption = None,
    insecure: InsecureOption = False,
    secret: SecretOption = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the hosts and the processes that they run; or join a system as one more host."""
    if join is None:
        if name is not None or stack_folder is not None or tls is not None or insecure or secret is not None or offer:
            raise BadInput("--name, --offer, --stack-folder, --tls, --insecure and --secret belong to --join ENDPOINT")
        with reached(ctx, system) as there:
            (show_resources if resources else _list)(there, as_json)
        return
    if resources:
        raise BadInput("--resources shows the hosts of a system: leave out --join")
    if name is None:
        raise BadInput("--join needs a --name to be a host under, such as --name edge")
    offered = read_offer(offer or [])
    guard = Guard(tls, insecure, secret)
    guard.check(join)
    named = chosen_system(ctx, system)
    endpoints = Endpoints(connect=(join,), tls=guard.tls(name), secret=guard.secret() or _secret_here(join, named))
    _be_host(Wanted(endpoints, name, named, stack_folder, offered), as_json)


# --- listing ---


def _list(there: Reached, as_json: bool) -> None:
    hosts = there.client.hosts().values()
    if as_json:
        show_json({"endpoint": there.info.join or there.info.endpoint, "hosts": [_plain(host) for host in hosts]})
        return
    say(f"other hosts join by: regraft host --join {there.info.join or there.info.endpoint} --name NAME")
    rows: list[tuple[Any, ...]] = []
    for h in hosts:
        rows += [
            (h.name, _state(h), p.component, p.state.value, p.pid or "", p.incarnation or "", p.restarts, p.exit_reason)
            for p in h.processes
        ]
        if not h.processes:
            rows.append((h.name, _state(h), "", "", "", "", "", ""))
    headings = ("host", "state", "component", "process", "pid", "run", "restarts", "last ended")
    show_table(headings, rows, empty="no hosts")


def _state(host: HostSeen) -> str:
    return host.state.value if host.state else "first"


def _plain(host: HostSeen) -> dict[str, Any]:
    return {
        "name": host.name,
        "alive": host.alive,
        "state": _state(host),
        "silent_s": host.age,
        "processes": [codec.to_plain(process) for process in host.processes],
        "status": codec.to_plain(host.status) if host.status else None,
    }


# --- joining ---


def _secret_here(join: str, system: str | None) -> str:
    """Return the secret of the system that this user runs on this machine, and that is joined; raises BadInput."""
    running = run_directory.running()
    found = [info for info in running if join in (info.endpoint, info.join)]
    found = found or [info for info in running if system in (None, info.system)]
    if len(found) == 1:
        return found[0].secret
    raise BadInput(
        "joining needs the system's secret: give --secret FILE, a copy of the file that the first host was started "
        "with ('regraft up STACK --secret FILE'), or a --tls folder with a bus.secret"
    )


def _be_host(wanted: Wanted, as_json: bool) -> None:
    told = False

    def step(joined: Joined) -> None:
        nonlocal told
        if not told:
            told = True
            log_to_file(joined.host.plan.folder)
            _say_joined(joined, as_json)
            for notice in joined.notices:
                complain(notice)

    with nothing_left_behind():
        ended = run_guest(wanted, step, complain)
    text = f"host {wanted.name} has ended: {ended.over}"
    if ended.orderly and as_json:
        system = ended.plan.architecture.system
        show_json({"system": system, "host": wanted.name, "ended": True, "why": ended.over}, compact=True)
    elif ended.orderly:
        say(text)
    elif ended.over:
        raise Unreachable(text)


def _say_joined(joined: Joined, as_json: bool) -> None:
    components = sorted(joined.host.processes)
    if as_json:
        shown = {"system": joined.system, "host": joined.host.plan.name, "components": components}
        show_json(shown, compact=True)
        return
    runs = f"; it runs {', '.join(components)}" if components else ""
    say(f"host {joined.host.plan.name} has joined system {joined.system}{runs}; Ctrl-C ends it")
