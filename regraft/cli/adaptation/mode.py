"""``regraft mode``: enters a mode of the stack, or of a ROS 2 system_modes file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.model.adaptation import AdaptationRequest, Change, EnterMode
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.modes import as_needed, is_in_force
from regraft.bus_schema.suggestions import no_such
from regraft.cli.adaptation import managing
from regraft.cli.adaptation.watched import Confirmation
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import reached, user
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


def mode(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="[MODE]", help="A mode of the stack or file; none: list.")] = "",
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
    """Enter a mode: all of its changes are made, or none; without a name, list the modes and which are in force."""
    confirmation = Confirmation.typed(confirm, watch)
    with reached(ctx, system) as there:
        managing.require_manager(there)
        if name and file is None:
            managing.change(
                there,
                EnterMode(name),
                reason=reason or f"mode {name}",
                dry_run=dry_run,
                as_json=as_json,
                confirmation=confirmation,
            )
            return
        now = there.client.architecture()
        modes = now.modes if file is None else read_system_modes(file, now.components)
        if not name:
            view = there.known.of_robot(robot).view
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
