"""How a run ends: its summary, asked of whoever offers one, in one line or one JSON object."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any

from regraft.bus.interface import BusError
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.evaluation import RunSummary, RunSummaryRequest
from regraft.bus_schema.model.architecture import Architecture
from regraft.client import Client, ClientError
from regraft.component.errors import CallFailed
from regraft.system.launch import Running

SERVICE = "run_summary"
SUMMARY_TIMEOUT = 10.0
DIGITS_SHOWN = 12


class SummaryAsked:
    """A question for the run's summary, on its way; whoever asked continues, and looks now and then."""

    def __init__(self, running: Running, service: str) -> None:
        self.summary: RunSummary | None = None
        self.problem = ""
        self._thread = threading.Thread(target=self._ask, args=(running, service), daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether there is a summary, or a problem."""
        return not self._thread.is_alive()

    def _ask(self, running: Running, service: str) -> None:
        try:
            with Client(running.bus, running.info.system) as client:
                self.summary = client.call(service, RunSummaryRequest(), RunSummary, SUMMARY_TIMEOUT)
        except (CallFailed, ClientError, BusError) as error:
            self.problem = str(error)


def summary_service(architecture: Architecture) -> str | None:
    """Return the name under which a run's summary is offered, None if nobody does."""
    offered = (spec.services.get(SERVICE) for spec in architecture.components.values())
    return next((name for name in offered if name), None)


@dataclass(frozen=True, slots=True)
class Closing:
    """The result of a run. ``wall_s`` leaves starting apart; a digest needs a recorder in the stack."""

    system: str
    simulated_s: float | None
    wall_s: float
    startup_s: float | None
    renderer: str | None
    reproducible: bool | None
    dropped: tuple[str, ...]
    restarts: int
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
        parts += [f"{name} {_shown(value)}" for name, value in self.summary.items() if name != "stamp" and value]
        return ", ".join((*parts, *self.problems))


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_shown(part)}" for name, part in value.items()) + "}"
    if isinstance(value, float):
        return f"{value:.4g}"
    return value[:DIGITS_SHOWN] if isinstance(value, str) else str(value)


def plain_summary(summary: RunSummary | None) -> dict[str, Any]:
    """Return a run's summary as plain data, empty without one."""
    return codec.to_plain(summary) if summary else {}
