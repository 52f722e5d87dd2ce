"""Asks what a component would be that is not there yet: its class is imported in a process of its own.

An author's module may hang, exit or crash while it is imported: neither the host nor the manager takes part in that.
"""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from regraft.bus.interface import Query
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage, SchemaError
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.host import DescribeComponent, DescribedComponent
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.host.host_publisher import refuse
from regraft.host.plan import HostPlan
from regraft.host.zygote.zygote import Zygote

DESCRIBE = "describe"
DESCRIBED_TIMEOUT = 20.0
"""Seconds that importing and describing a class may take."""
MAX_AT_ONCE = 16


@dataclass(slots=True)
class _Asked:
    query: Query
    spec: ComponentSpec
    answer: Path
    deadline: float
    pid: int = 0
    late: bool = False


class Describer:
    """The host's questions about classes that are under way."""

    def __init__(self, zygote: Zygote, plan: HostPlan) -> None:
        """Nothing has been asked."""
        self._zygote = zygote
        self._stack_folder = plan.stack_folder
        self._folder = plan.folder
        self._plan = plan
        self._references = {robot: plan.found_here(values) for robot, values in plan.references.items()}
        self._asked: dict[str, _Asked] = {}
        self._count = 0

    def ask(self, query: Query) -> None:
        """Begin to answer a query; raises BadMessage, OSError."""
        wanted = codec.decode(query.payload, DescribeComponent)
        spec = replace(wanted.spec, parameters=self._plan.found_here(wanted.spec.parameters))
        if len(self._asked) >= MAX_AT_ONCE:
            raise BadMessage(f"{MAX_AT_ONCE} components are being described already: ask again later")
        self._count += 1
        name = f"{DESCRIBE}/{self._count}"  # no component can be named so
        answer = self._folder / f"{DESCRIBE}-{self._count}"
        order = {
            "spec": codec.to_plain(spec),
            "context": wanted.context,
            "answer": str(answer),
            "stack_folder": str(self._stack_folder),
            "folder": str(self._folder),
            "references": self._references,
        }
        log = str(self._folder / "logs" / f"{DESCRIBE}.log")
        self._asked[name] = _Asked(query, spec, answer, time.monotonic() + DESCRIBED_TIMEOUT)
        self._zygote.describe(name, order, str(self._stack_folder), log)

    def takes(self, report: Mapping[str, Any]) -> bool:
        """Take a report of the zygote if it is about a question; the end of its process answers it."""
        asked = self._asked.get(report["name"])
        if asked is None:
            return False
        if "started" in report:
            asked.pid = report["started"]
        else:
            del self._asked[report["name"]]
            self._answer(asked, report["code"])
        return True

    def _answer(self, asked: _Asked, code: int) -> None:
        try:
            described = codec.decode(asked.answer.read_bytes(), DescribedComponent)
        except (OSError, SchemaError):
            how = f"ended with exit code {code}" if code >= 0 else f"was killed by signal {-code}"
            if asked.late:
                how = f"had not done so after {DESCRIBED_TIMEOUT:g} s"
            problem = f"{asked.spec.cls!r} cannot be described: the process that was to import it {how}"
            refuse(asked.query, ControlCode.FAILED, problem)
        else:
            spec = replace(described.spec, parameters=self._plan.found_there(described.spec.parameters))
            asked.query.reply(codec.encode(replace(described, spec=spec)))
        finally:
            with contextlib.suppress(OSError):
                asked.answer.unlink()

    def look(self, now: float) -> None:
        """Kill whoever takes too long."""
        for asked in self._asked.values():
            if now > asked.deadline and asked.pid:
                asked.late = True
                self._zygote.signal(asked.pid, signal.SIGKILL)
