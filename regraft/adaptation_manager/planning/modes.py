"""Modes: named sets of changes that the stack defines, done as if they had been asked for one by one."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import replace

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import AdaptationReport, AdaptationRequest, Change, EnterMode, Violation
from regraft.bus_schema.model.architecture import Architecture
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.modes.modes import as_needed
from regraft.bus_schema.suggestions import instead_of


class NoSuchMode(Exception):
    """The stack has no such mode, or one that cannot be read; the text states which."""


def changes_of(mode: str, architecture: Architecture) -> tuple[Change, ...]:
    """Return the changes that enter a mode; raises NoSuchMode."""
    if mode not in architecture.modes:
        raise NoSuchMode(f"there is no mode {mode!r}; {instead_of(mode, architecture.modes)}")
    try:
        changes = codec.from_plain({"changes": architecture.modes[mode]}, AdaptationRequest).changes
    except BadMessage as error:
        raise NoSuchMode(f"mode {mode!r}: {error}") from None
    if any(isinstance(change, EnterMode) for change in changes):
        raise NoSuchMode(f"mode {mode!r} enters another mode: it must name the changes themselves")
    return changes


def meant(changes: Sequence[Change], architecture: Architecture) -> list[Change]:
    """Return the changes with those of each mode in its place, needed or not. A mode that is wrong has none."""
    found: list[Change] = []
    for change in changes:
        with contextlib.suppress(NoSuchMode):
            found += changes_of(change.mode, architecture) if isinstance(change, EnterMode) else (change,)
    return found


def expanded(
    changes: Sequence[Change], architecture: Architecture, states: Mapping[str, State] | None = None
) -> tuple[list[tuple[int, Change]], list[Violation]]:
    """Return the changes with those of each mode in its place, with the index that each was asked for under.

    ``states`` are those that components are in, where they differ from the architecture.
    """
    found: list[tuple[int, Change]] = []
    wrong = []
    for index, change in enumerate(changes):
        if not isinstance(change, EnterMode):
            found.append((index, change))
            continue
        try:
            meant = as_needed(
                changes_of(change.mode, architecture), architecture, [earlier for _, earlier in found], states
            )
            found += [(index, one) for one in meant]
        except NoSuchMode as error:
            wrong.append(Violation(index, change.component, "mode", str(error)))
    return found, wrong


def unfolded(report: AdaptationReport, architecture: Architecture) -> AdaptationReport:
    """Return the line of an applied adaptation with the changes of its modes; modes stay what they were for a run."""
    changes = tuple(change for _, change in expanded(report.request.changes, architecture)[0])
    return replace(report, request=replace(report.request, changes=changes))
