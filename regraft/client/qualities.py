"""The qualities that a system's components measure of themselves, as seen from outside: known, or unknown and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass

from regraft.bus_schema.annotations import Seconds
from regraft.bus_schema.messages.management.qualities import MeasuredQualities
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.qualities.qualities import Better, QualityDescription, measured
from regraft.client.client import Client
from regraft.client.errors import ClientError
from regraft.client.seen import ComponentSeen

ANSWER_TIMEOUT = 1.0
"""Seconds for a component that has published nothing since the client came."""
HEARTBEAT_TIMEOUT = 1.0
"""Seconds without a heartbeat after which nothing counts that was measured before."""


@dataclass(frozen=True, slots=True)
class QualityNow:
    """A quality that a component measures: its latest value, or null and ``why`` it is unknown.

    ``measured`` is when that was, in seconds of the component's clock; null if never.
    """

    component: str
    quality: str
    unit: str
    better: Better
    functional: bool
    minimum: float | None
    maximum: float | None
    value: float | None
    why: str
    measured: Seconds | None

    def plain(self) -> dict[str, object]:
        """Return it as plain data."""
        return {**asdict(self), "better": self.better.value}


def measures(spec: ComponentSpec) -> tuple[QualityDescription, ...]:
    """Return the qualities that a component publishes."""
    described = spec.description
    return measured(described.qualities) if described is not None and described.evaluate_every is not None else ()


def qualities_now(client: Client, specs: Mapping[str, ComponentSpec], wait: float) -> tuple[QualityNow, ...]:
    """Return all measured qualities of components, waiting at most ``wait`` seconds for their statuses."""
    seen = client.components(wait)
    return tuple(
        line
        for name, spec in sorted(specs.items())
        if measures(spec)
        for line in _lines(client, spec, seen.get(name, ComponentSeen(name)))
    )


def _lines(client: Client, spec: ComponentSpec, seen: ComponentSeen) -> Iterator[QualityNow]:
    why = _why_silent(seen)
    last = None if why else _last(client, seen)
    if not why and last is None:
        why = "it does not answer"
    elif last is not None and seen.status is not None and last.is_late(seen.status.stamp):
        why = f"late: measured every {last.period:g} s, and not for {seen.status.stamp - last.stamp:.1f} s"
    for quality in measures(spec):
        known = last.values.get(quality.name) if last is not None and not why else None
        reason = why or (last.unknown.get(quality.name, "") if last is not None else "")
        yield QualityNow(
            spec.name,
            quality.name,
            quality.unit,
            quality.better,
            quality.functional,
            quality.minimum,
            quality.maximum,
            known,
            "" if known is not None else reason or "not given",
            last.stamp if last is not None else None,
        )


def _why_silent(seen: ComponentSeen) -> str:
    if not seen.alive or seen.status is None:
        return "the component is not there"
    if seen.state is not State.ACTIVE:
        return f"the component is {seen.status.state.value}"
    if seen.age is not None and seen.age > HEARTBEAT_TIMEOUT:
        return f"the component has given no sign of life for {seen.age:.1f} s"
    return ""


def _last(client: Client, seen: ComponentSeen) -> MeasuredQualities | None:
    """Return what a component has published last; it is asked if this client has heard nothing of this run."""
    heard = client.last_measured(seen.name)
    if heard is not None and seen.status is not None and heard.incarnation == seen.status.incarnation:
        return heard
    try:
        return client.ask_measured(seen.name, ANSWER_TIMEOUT)
    except ClientError:
        return None
