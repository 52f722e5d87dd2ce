"""How a run ends: its summary, asked of all that offer one, in one line or one JSON object."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from regraft.bus.interface import BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.evaluation import RunSummary, RunSummaryRequest
from regraft.bus_schema.messages.protocol.clock import RunCause
from regraft.bus_schema.model.architecture import Architecture
from regraft.client import Client, ClientError
from regraft.component.errors import CallFailed
from regraft.patience import stretched
from regraft.system.launch import Running

SERVICE = "run_summary"
SUMMARIES = "summaries"
"""The field with the summary of each of several recorders."""
SUMMARY_TIMEOUT = 10.0
"""Seconds that each component that sums up the run has for it; more on a crowded machine."""
DIGITS_SHOWN = 12


class SummaryAsked:
    """A question for the run's summaries, on its way; its caller continues, and looks now and then.

    ``summaries`` has the answers so far, by component.
    """

    def __init__(self, running: Running, services: Mapping[str, str]) -> None:
        self.summaries: dict[str, RunSummary] = {}
        self.problem = ""
        self._thread = threading.Thread(target=self._ask, args=(running, services), daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether all summaries are there, or a problem."""
        return not self._thread.is_alive()

    def _ask(self, running: Running, services: Mapping[str, str]) -> None:
        try:
            with Client(running.bus, running.info.system) as client:
                for component, service in services.items():
                    found = client.call(service, RunSummaryRequest(), RunSummary, stretched(SUMMARY_TIMEOUT))
                    self.summaries = {**self.summaries, component: found}  # the caller looks at it meanwhile
        except (CallFailed, ClientError, BusError) as error:
            self.problem = str(error)


def summary_services(architecture: Architecture) -> dict[str, str]:
    """Return the names under which summaries of the run are offered, by component."""
    offered = ((name, spec.services.get(SERVICE)) for name, spec in sorted(architecture.components.items()))
    return {name: service for name, service in offered if service}


@dataclass(frozen=True, slots=True)
class Closing:
    """The result of a run. ``wall_s`` leaves starting apart; a digest needs a recorder in the stack.

    ``causes`` are why it is not repeatable, or why parts of it were restarted.
    """

    system: str
    simulated_s: float | None
    wall_s: float
    startup_s: float | None
    renderer: str | None
    reproducible: bool | None
    dropped: tuple[str, ...]
    restarts: int
    causes: tuple[RunCause, ...] = ()
    problems: tuple[str, ...] = ()
    summary: dict[str, Any] = field(default_factory=dict)

    @property
    def real_time_factor(self) -> float | None:
        """Simulated seconds per second."""
        return self.simulated_s / self.wall_s if self.simulated_s is not None and self.wall_s > 0 else None

    def plain(self) -> dict[str, Any]:
        """Return it as plain data."""
        factor = self.real_time_factor
        return {
            "system": self.system,
            "simulated_s": self.simulated_s,
            "wall_s": round(self.wall_s, 3),
            "startup_s": None if self.startup_s is None else round(self.startup_s, 3),
            "real_time_factor": None if factor is None else round(factor, 3),
            "renderer": self.renderer,
            "digest": None,
            "reproducible": self.reproducible,
            "dropped": list(self.dropped),
            "restarts": self.restarts,
            "causes": [codec.to_plain(cause) for cause in self.causes],
            "problems": list(self.problems),
            **self.summary,
        }

    def line(self) -> str:
        """Return it as one line."""
        factor = self.real_time_factor
        ran = (
            f"ran {self.wall_s:.1f} s"
            if self.simulated_s is None or factor is None
            else f"{self.simulated_s:g} s simulated in {self.wall_s:.1f} s ({factor:.1f} x real time)"
        )
        parts = [f"{self.system}: {ran}"]
        if self.renderer:
            parts.append(f"renderer {self.renderer}")
        if self.reproducible is not None:
            parts.append("reproducible" if self.reproducible else "not reproducible")
        if self.dropped:
            parts.append(f"dropped from simulated time: {', '.join(self.dropped)}")
        if self.restarts:
            parts.append(f"{self.restarts} restart{'' if self.restarts == 1 else 's'}")
        parts += [f"{cause.code.value}: {cause.component}" for cause in self.causes[:1]]
        shown = ((name, value) for name, value in self.summary.items() if name not in ("stamp", SUMMARIES))
        parts += [f"{name} {_shown(value)}" for name, value in shown if value]
        return ", ".join((*parts, *self.problems))


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_shown(part)}" for name, part in value.items()) + "}"
    if isinstance(value, float):
        return f"{value:.4g}"
    return value[:DIGITS_SHOWN] if isinstance(value, str) else str(value)


def plain_summary(summaries: Mapping[str, RunSummary]) -> dict[str, Any]:
    """Return a run's summary as plain data, empty without one.

    Several are summed up; ``summaries`` has each, by its component. Counted things have the names of their
    robots then: ``left/middle_box``.
    """
    plain: dict[str, dict[str, Any]] = {name: codec.to_plain(summary) for name, summary in summaries.items()}
    if len(plain) < 2:
        return next(iter(plain.values()), {})
    digest = hashlib.sha256()
    for name, each in plain.items():
        digest.update(name.encode() + _bytes_of(each["digest"]))
    together = {field: max(each[field] for each in plain.values()) for field in ("stamp", "ticks")}
    together |= {field: sum(each[field] for each in plain.values()) for field in ("contacts", "distance")}
    counts = {field: _by_robot(plain, field) for field in ("visits", "pictures", "hits", "adaptations")}
    return {"digest": digest.hexdigest(), **together, **counts, SUMMARIES: plain}


def _bytes_of(digest: str) -> bytes:
    """Return what the joint digest covers of a recorder's digest, which may be any text."""
    try:
        return bytes.fromhex(digest)
    except ValueError:
        return b"\0" + digest.encode()


def _by_robot(plain: Mapping[str, dict[str, Any]], field: str) -> dict[str, int]:
    found: dict[str, int] = {}
    for component, each in plain.items():
        robot = component.rpartition(".")[0]
        prefix = f"{robot}/" if robot else ""
        found |= {prefix + name.removeprefix(prefix): count for name, count in each[field].items()}
    return found
