"""The changes of one adaptation that puts designs in place, and brings to rest what nothing uses any more."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from regraft.adaptation_manager.planners.metacontrol.control.modes.designs import DesignMode
from regraft.adaptation_manager.planning.modes import NoSuchMode, changes_of
from regraft.bus_schema.model.adaptation import Change, ChangeState, EnterMode
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.bus_schema.model.modes.modes import as_needed


def changes_to(
    wanted: Iterable[DesignMode],
    left: Iterable[DesignMode],
    architecture: Architecture,
    states: Mapping[str, State],
    fallen: Collection[str] = (),
) -> tuple[Change, ...]:
    """Return the changes after which the wanted designs are in force, and those that are left are not.

    No other design changes a component that a wanted design claims. A mode is entered by its name if all of it can be
    done. ``states`` are those that components are in. Modes that have ``fallen`` are entered again.
    """
    modes = {each.mode: each for each in wanted}
    parts = {each.part for each in modes.values()}
    claimed = {component for each in modes.values() for component in each.claims}
    found: list[Change] = []

    def enter(mode: str, changes: tuple[Change, ...], others: Collection[str]) -> None:
        kept = tuple(each for each in changes if each.component not in others)
        found.extend((EnterMode(mode),) if kept == changes else as_needed(kept, architecture, found, states))

    for each in {each.part: each for each in left if each.part not in parts}.values():
        if not each.rest or architecture.asked_modes.get(each.part) != each.rest:
            enter(each.rest, _changes_of_rest(each, architecture), claimed)
    for each in modes.values():
        if each.mode in fallen or not in_force(each, architecture):
            enter(each.mode, each.changes, claimed - each.claims.keys())
    return tuple(found)


def in_force(design: DesignMode, architecture: Architecture) -> bool:
    """Return whether a design's mode was the last of its part to be asked for."""
    return architecture.asked_modes.get(design.part) == design.mode


def _changes_of_rest(left: DesignMode, architecture: Architecture) -> tuple[Change, ...]:
    """Return the changes that bring a design's part to rest; without such a mode its components are deactivated."""
    try:
        return changes_of(left.rest, architecture)
    except NoSuchMode:
        down = (ChangeState(component, Transition.DEACTIVATE) for component in left.claims)
        return as_needed(down, architecture)
