"""The changes of one adaptation that puts designs in place, and brings to rest what nothing uses any more."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from regraft.adaptation_manager.planners.metacontrol.control.modes.designs import DesignMode
from regraft.adaptation_manager.planning.modes import NoSuchMode, changes_of
from regraft.bus_schema.model.adaptation import Add, Change, ChangeState, EnterMode
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.bus_schema.model.modes.modes import as_needed, is_in_force


def changes_to(
    wanted: Iterable[DesignMode],
    left: Iterable[DesignMode],
    architecture: Architecture,
    states: Mapping[str, State],
    fallen: Collection[str] = (),
) -> tuple[Change, ...]:
    """Return the changes after which the wanted designs are in force, and those that are left are not.

    No other design changes a component that a wanted design claims. A mode is entered by its name if all of it can be
    done. Components that were removed from the stack are left out of what is released. ``states`` are those that
    components are in. Modes that have ``fallen`` are entered again.
    """
    left = tuple(left)
    modes = {each.mode: each for each in wanted}
    parts = {each.part for each in modes.values()}
    claimed = {component for each in modes.values() for component in each.claims}
    grounded = {each.mode for each in left}
    found: list[Change] = []

    def kept_of(changes: tuple[Change, ...], own: Collection[str]) -> tuple[Change, ...]:
        there = architecture.components.keys() | {each.component for each in changes if isinstance(each, Add)}
        return tuple(each for each in changes if each.component in own or each.component in there - claimed)

    def enter(mode: str, changes: tuple[Change, ...], own: Collection[str]) -> None:
        kept = kept_of(changes, own)
        if mode and kept == changes:
            found.append(EnterMode(mode))
            return
        stays = mode in grounded and mode not in fallen
        needed = as_needed(kept, architecture, found, None if stays else states)
        found.extend(each for each in needed if isinstance(each, ChangeState) or not is_in_force((each,), architecture))

    for each in {each.part: each for each in left if each.part not in parts}.values():
        if not each.rest or architecture.asked_modes.get(each.part) != each.rest:
            enter(each.rest, _changes_of_rest(each, architecture), ())
    for each in modes.values():
        # A rest that spared a component of another design, and so was not entered, leaves the mode asked for.
        left_since = each.mode not in grounded and not is_in_force(kept_of(each.changes, each.claims), architecture)
        if each.mode in fallen or left_since or not in_force(each, architecture):
            enter(each.mode, each.changes, each.claims)
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
