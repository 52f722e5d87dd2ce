"""Objectives as they are typed, or as a file has them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.records import record_shape
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.objectives import CurvePoint, Objective
from regraft.bus_schema.model.qualities.bounds import Bound, read_bounds
from regraft.bus_schema.model.qualities.curves import read_curve
from regraft.bus_schema.suggestions import no_such
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.values import assignments, line_of, read_located
from regraft.component.errors import CallFailed
from regraft.stack.yaml.nodes import Location, Node, locations_of, plain

MAX_OBJECTIVES: Final = 100
"""Objectives of one request."""
OBJECTIVES: Final = "objectives"


def bounds(texts: Iterable[str]) -> dict[str, Bound]:
    """Return the bounds that were typed, by quality; raises BadInput."""
    try:
        return read_bounds(texts)
    except ValueError as error:
        raise BadInput(str(error)) from None


def weights(texts: Sequence[str] | None) -> dict[str, float] | None:
    """Return the weights of ``--weight QUALITY=NUMBER``, None if there are none; raises BadInput."""
    found = assignments(texts or (), "--weight ")
    return {name: _number(f"--weight {name}", value) for name, value in found.items()} or None


def curves(texts: Sequence[str] | None) -> dict[str, tuple[CurvePoint, ...]] | None:
    """Return the curves of ``--curve QUALITY=VALUE:UTILITY,...``, None if there are none; raises BadInput."""
    found: dict[str, tuple[CurvePoint, ...]] = {}
    for text in texts or ():
        try:
            quality, points = read_curve(text)
        except ValueError as error:
            raise BadInput(f"--curve {error}") from None
        if quality in found:
            raise BadInput(f"--curve {quality}: is given twice: leave one out")
        found[quality] = tuple(CurvePoint(*point) for point in points)
    return found or None


def _number(place: str, value: object) -> float:
    try:
        number = math.nan if isinstance(value, bool) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise BadInput(f"{place}: {value!r} must be a finite number")
    return number


@dataclass(frozen=True, slots=True)
class Wanted:
    """The objectives that are asked for, and where the fields of a file are; ``is_list`` where it lists objectives."""

    objectives: tuple[Objective, ...]
    locations: Mapping[str, Location] = field(default_factory=dict)
    is_list: bool = False

    def at_fault(self, refused: CallFailed) -> CallFailed:
        """Return a refusal with the field as it was typed, or with the line of the file."""
        if not refused.field:
            return refused
        own = refused.field if self.is_list else refused.field.removeprefix(f"{OBJECTIVES}.0.")
        return CallFailed(
            line_of(own.split("."), self.locations) or refused.service,
            refused.answer,
            refused.problem,
            code=refused.code,
            field=own,
            retry_after=refused.retry_after,
        )


def objectives_in(file: str) -> Wanted:
    """Return the objectives in a YAML or JSON file, ``-`` for standard input; raises BadInput with file and line."""
    node = read_located(file)
    if not isinstance(node.value, dict):
        raise BadInput(f"{node.location}: is {node.kind}, must be an objective, or a map with a list {OBJECTIVES!r}")
    if OBJECTIVES not in node.value:
        return Wanted((_objective(node),), locations_of(node))
    _refuse_unknown(node, (OBJECTIVES,))
    listed = node.value[OBJECTIVES]
    if not isinstance(listed.value, tuple) or not 1 <= len(listed.value) <= MAX_OBJECTIVES:
        raise BadInput(f"{listed.location}: {OBJECTIVES}: must be a list of 1 to {MAX_OBJECTIVES} objectives")
    return Wanted(tuple(_objective(each) for each in listed.value), locations_of(node), is_list=True)


def _objective(node: Node) -> Objective:
    _refuse_unknown(node, [name for name, _ in record_shape(Objective).fields])
    locations: Mapping[str, Location] = locations_of(node)
    try:
        return codec.from_plain(plain(node), Objective)
    except BadMessage as error:
        raise BadInput(f"{line_of(error.where, locations) or node.location}: {error}") from None


def _refuse_unknown(node: Node, known: Sequence[str]) -> None:
    for name, other in node.value.items() if isinstance(node.value, dict) else ():
        if name not in known:
            raise BadInput(f"{other.location}: {no_such('field', name, known)}")
