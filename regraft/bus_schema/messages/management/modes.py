"""Modes of a running system: what was asked for, what is, and what could be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from regraft.bus_schema.annotations import Count, Seconds, ToldBriefly
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.modes.mode_parts import PartKind

MODES: Final = "adaptation_manager/modes"
"""The service that answers `ModesRequest` with `SystemModes`."""
DECIDER: Final = "modes/decider"
"""The service of the one component that enforces rules; it answers `DeciderRequest` with `DeciderStatus`."""


@message("regraft/ModesRequest")
@dataclass(frozen=True, slots=True)
class ModesRequest:
    """Report the modes of all parts. ``reachable`` has each mode checked as an adaptation that enters it now."""

    reachable: bool = False


@message("regraft/ModeStatus")
@dataclass(frozen=True, slots=True)
class ModeStatus:
    """A mode that is available. It ``fits`` if all is as it wants, also while another one counts as the actual mode.

    ``reachable`` is whether it could be entered now, ``problem`` why not; None where that was not asked.
    """

    mode: str
    fits: bool
    reachable: bool | None = None
    problem: ToldBriefly = ""


@message("regraft/PartModes")
@dataclass(frozen=True, slots=True)
class PartModes:
    """A component, robot, subsystem or the system (an empty ``part``), with the modes that it has.

    ``target`` is the mode that was asked for last, ``actual`` the one inferred from status and read-back values; each
    empty for none. ``as_asked`` is whether the architecture has all that the target wants. ``state`` is the actual
    state, in the words of ROS 2's lifecycle or ``unknown``; ``target_state`` the one in the architecture, of a
    component only.
    """

    part: str
    kind: PartKind
    target: str = ""
    actual: str = ""
    as_asked: bool = True
    state: str = ""
    target_state: str = ""
    failure: ToldBriefly = ""
    modes: tuple[ModeStatus, ...] = ()


@message("regraft/SystemModes")
@dataclass(frozen=True, slots=True)
class SystemModes:
    """The modes of all parts, the system first, at a revision of the architecture; ``decider`` enforces the rules."""

    stamp: Seconds
    revision: Count
    parts: tuple[PartModes, ...] = ()
    decider: str = ""

    def part(self, name: str) -> PartModes | None:
        """Return the part of that name, None if there is no such part."""
        return next((each for each in self.parts if each.part == name), None)


@message("regraft/DeciderRequest")
@dataclass(frozen=True, slots=True)
class DeciderRequest:
    """Report how the rules are enforced."""


@message("regraft/RuleStatus")
@dataclass(frozen=True, slots=True)
class RuleStatus:
    """A rule: whether its condition ``holds`` (None: not known, and ``why``), and until when it is suspended."""

    rule: str
    mode: str
    holds: bool | None
    why: ToldBriefly = ""
    suspended_until: Seconds | None = None


@message("regraft/DeciderStatus")
@dataclass(frozen=True, slots=True)
class DeciderStatus:
    """The rules, in their order; ``manual_until``: until when a change by others is left alone, by part."""

    stamp: Seconds
    rules: tuple[RuleStatus, ...] = ()
    manual_until: dict[str, Seconds] | None = None
