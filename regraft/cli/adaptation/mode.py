"""``regraft mode``: enters a mode of the stack or of a ROS 2 system_modes file, or shows which there are."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.modes import MODES, ModesRequest, SystemModes
from regraft.bus_schema.model.adaptation import AdaptationRequest, Change, EnterMode
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.modes.modes import as_needed, is_in_force
from regraft.bus_schema.suggestions import no_such
from regraft.cli.adaptation import managing
from regraft.cli.adaptation.mode_tables import show_modes, show_parts
from regraft.cli.adaptation.watched import Confirmation
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import Reached, reached, user
from regraft.cli.terminal.options import (
    ConfirmOption,
    DryRunOption,
    JsonOption,
    ReasonOption,
    RobotOption,
    SystemOption,
    WatchOption,
)
from regraft.cli.terminal.output import say, show_json, show_table
from regraft.stack.sections.system_modes import read_system_modes

SHOW, LIST = "show", "list"
MODES_TIMEOUT = 20.0
"""Seconds for all modes to be checked."""


def mode(
    ctx: typer.Context,
    name: Annotated[
        str, typer.Argument(metavar="[MODE]", help="A mode of the stack or file; 'list', or none: list; 'show': parts.")
    ] = "",
    part: Annotated[str, typer.Argument(metavar="[PART]", help="Behind 'show': a component, robot or subsystem.")] = "",
    file: Annotated[
        Path | None, typer.Option("--from", metavar="FILE", help="A modes file of ROS 2's system_modes.")
    ] = None,
    robot: RobotOption = "",
    dry_run: DryRunOption = False,
    reason: ReasonOption = "",
    confirm: ConfirmOption = None,
    watch: WatchOption = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Enter a mode: all of its changes are made, or none; or list modes, or show what is in which mode."""
    confirmation = Confirmation.typed(confirm, watch)
    if part and name != SHOW:
        raise BadInput(f"{part!r}: a part is only named behind 'show'")
    with reached(ctx, system) as there:
        managing.require_manager(there)
        view = there.known.of_robot(robot).view
        if name == SHOW:
            show_parts(_modes(there, reachable=False), view.part(part), view, as_json=as_json)
            return
        name = "" if name == LIST else name
        if name and file is None:
            entered = view.mode(name)
            managing.change(
                there,
                EnterMode(entered),
                reason=reason or f"mode {entered}",
                dry_run=dry_run,
                as_json=as_json,
                confirmation=confirmation,
            )
            return
        now = there.client.architecture()
        modes = now.modes if file is None else read_system_modes(file, now.components, robot)
        if not name:
            if file is None:
                show_modes(_modes(there, reachable=True), view, as_json=as_json)
            else:
                _list({name: each for name, each in modes.items() if view.has_mode(name)}, now, as_json=as_json)
            return
        if name not in modes:
            raise BadInput(f"{file}: {no_such('mode', name, modes)}")
        changes = as_needed(_changes(modes[name]), now)
        if not changes:
            _say_in_force(name, as_json=as_json)
            return
        request = AdaptationRequest(
            changes,
            reason or f"mode {name}",
            user(),
            now.revision,
            dry_run=dry_run,
            confirm=confirmation.confirm,
            watch=confirmation.watch,
        )
        managing.show_report(managing.adapt(there, request), as_json=as_json)


def _modes(there: Reached, *, reachable: bool) -> SystemModes:
    return managing.ask(there, MODES, ModesRequest(reachable), SystemModes, MODES_TIMEOUT)


def _say_in_force(name: str, *, as_json: bool) -> None:
    if as_json:
        show_json({"mode": name, "in_force": True})
    else:
        say(f"mode {name} is in force already")


def _changes(mode: PlainValue) -> tuple[Change, ...]:
    return codec.from_plain({"changes": mode}, AdaptationRequest).changes


def _list(modes: dict[str, PlainValue], now: Architecture, *, as_json: bool) -> None:
    found = {name: is_in_force(_changes(changes), now) for name, changes in modes.items()}
    if as_json:
        show_json([{"mode": name, "in_force": so} for name, so in found.items()])
        return
    rows = [(name, "yes" if so else "") for name, so in found.items()]
    show_table(("mode", "in force"), rows, empty="the stack names no modes")
