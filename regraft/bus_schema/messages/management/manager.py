"""Requests to the adaptation manager, next to ``AdaptationRequest`` itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Count, Seconds, Text
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.management.system import SystemFault
from regraft.bus_schema.model.adaptation import AdaptationReport
from regraft.bus_schema.model.watched import Condition


@message("regraft/UndoAdaptation")
@dataclass(frozen=True, slots=True)
class UndoAdaptation:
    """Undo an applied adaptation by a new one; a dry run gives that one's plan, and touches nothing.

    The other fields are those of the new one, as in an ``AdaptationRequest``: a repeated request with its ``key`` is
    the same undo.
    """

    id: str
    actor: Annotated[str, Text(200)] = ""
    reason: Annotated[str, Text(1000)] = ""
    dry_run: bool = False
    confirm: Annotated[Seconds, Bounds(0.0, 86_400.0)] = 0.0
    watch: tuple[Condition, ...] = ()
    revision: Count | None = None
    key: Annotated[str, Text(200)] = ""
    wait: bool = True


@message("regraft/CancelAdaptation")
@dataclass(frozen=True, slots=True)
class CancelAdaptation:
    """Cancel an adaptation that waits, is under way, or is being confirmed."""

    id: str


@message("regraft/ConfirmAdaptation")
@dataclass(frozen=True, slots=True)
class ConfirmAdaptation:
    """Confirm an adaptation before its time is over: it is final then."""

    id: str


@message("regraft/JournalRequest")
@dataclass(frozen=True, slots=True)
class JournalRequest:
    """Lines of the journal, newest first: one by ``id``, or those older than the one with id ``before``."""

    id: str = ""
    before: str = ""
    limit: Annotated[int, Bounds(1, 500)] = 50


@message("regraft/JournalPage")
@dataclass(frozen=True, slots=True)
class JournalPage:
    """Lines of the journal, newest first; ``more`` if there are older ones.

    ``faults`` are the failures and recoveries of components in the time of these lines, newest first. ``waiting``, on
    the first page alone, are adaptations without a line yet: they wait for their turn, or are being checked.
    """

    entries: tuple[AdaptationReport, ...]
    more: bool = False
    faults: tuple[SystemFault, ...] = ()
    waiting: tuple[AdaptationReport, ...] = ()


@message("regraft/ArchitectureTagRequest")
@dataclass(frozen=True, slots=True)
class ArchitectureTagRequest:
    """Ask for the tag of the architecture as it should be now."""


@message("regraft/ArchitectureTag")
@dataclass(frozen=True, slots=True)
class ArchitectureTag:
    """Stands for one state of the architecture: no later state has the same (as an ETag, RFC 9110, section 8.8.3)."""

    tag: Annotated[str, Text(200)]


@message("regraft/ArchitectureRequest")
@dataclass(frozen=True, slots=True)
class ArchitectureRequest:
    """The architecture at a revision of this run; None for the current one."""

    revision: Count | None = None
