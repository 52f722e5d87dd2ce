"""Tables of modes: those that there are, and the parts that are in them."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.management.modes import ModeStatus, PartModes, SystemModes
from regraft.bus_schema.model.robots.robot_view import RobotView
from regraft.bus_schema.suggestions import no_such
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.output import show_json, show_table

THE_SYSTEM = "(system)"


def _modes(found: SystemModes, view: RobotView) -> Iterator[tuple[PartModes, ModeStatus]]:
    yield from ((part, mode) for part in found.parts for mode in part.modes if view.has_mode(mode.mode))


def show_modes(found: SystemModes, view: RobotView, *, as_json: bool) -> None:
    """Print all modes: which are in force, which were asked for, and which could be entered."""
    modes = list(_modes(found, view))
    if as_json:
        lines = [
            {
                "mode": mode.mode,
                "in_force": part.actual == mode.mode,
                "asked_for": part.target == mode.mode,
                "fits": mode.fits,
                "reachable": mode.reachable,
                "problem": mode.problem,
            }
            for part, mode in modes
        ]
        show_json(lines)
        return
    rows = [
        (
            mode.mode,
            _yes(part.actual == mode.mode),
            _yes(part.target == mode.mode),
            "yes" if mode.reachable else f"no: {mode.problem}",
        )
        for part, mode in modes
    ]
    show_table(("mode", "in force", "asked for", "reachable"), rows, empty="the stack names no modes")


def _yes(so: bool) -> str:
    return "yes" if so else ""


def show_parts(found: SystemModes, name: str, view: RobotView, *, as_json: bool) -> None:
    """Print the target, the actual mode and the state of all parts, or of one; raises BadInput."""
    named = {part.part or THE_SYSTEM: part for part in found.parts}
    if name and name not in named:
        raise BadInput(no_such("part", name, named))
    parts = [named[name]] if name else [each for each in found.parts if view.has_part(each.part)]
    if as_json:
        show_json([codec.to_plain(part) for part in parts])
        return
    rows = [(part.part or THE_SYSTEM, part.kind.value, part.target, part.actual, _state(part)) for part in parts]
    show_table(("part", "kind", "target", "actual", "state"), rows, empty="there are no parts")


def _state(part: PartModes) -> str:
    differs = part.target_state and part.target_state != part.state
    left = "" if part.as_asked else "; changed since its mode was asked for"
    return f"{part.state}{f' (should be {part.target_state})' if differs else ''}{left}"
