"""Asks classes what their components would be, and give: they are imported in a process of its own.

An author's module may hang, exit or crash while it is imported, and its estimators while they are called: neither the
host nor the manager takes part in that.
"""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from regraft.bus.interface import Query
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage, SchemaError
from regraft.bus_schema.messages.protocol.control import ControlCode
from regraft.bus_schema.messages.protocol.host import (
    DescribeComponent,
    DescribedComponent,
    EstimatedQualities,
    EstimateQualities,
)
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.host.host_publisher import refuse
from regraft.host.plan import HostPlan
from regraft.host.zygote.estimate_process import UNDER_WAY
from regraft.host.zygote.zygote import Zygote

DESCRIBE, ESTIMATE = "describe", "estimate"
DESCRIBED_TIMEOUT = 20.0
"""Seconds that importing and describing a class may take, or estimating an architecture."""
MAX_AT_ONCE = 16
MAX_LEFT_OUT = 3
"""Estimators that may end their process before the rest is given up."""


@dataclass(slots=True)
class _Asked:
    """A question. ``reply`` makes the payload of the reply; ``left_out`` has the estimators that ended a process."""

    query: Query
    task: str
    order: dict[str, Any]
    reply: Callable[[bytes], bytes]
    answer: Path
    deadline: float = 0.0
    pid: int = 0
    late: bool = False
    left_out: dict[str, str] = field(default_factory=dict)


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
        """Begin to describe a component; raises BadMessage, OSError."""
        wanted = codec.decode(query.payload, DescribeComponent)
        spec = self._found_here(wanted.spec)
        order = {
            "spec": codec.to_plain(spec),
            "stack_folder": str(self._stack_folder),
            "folder": str(self._folder),
            "references": self._references,
        }
        task = f"{spec.cls!r} cannot be described: the process that was to import it"
        self._begin(_Asked(query, task, order, self._found_there, self._free_file()))

    def ask_estimates(self, query: Query) -> None:
        """Begin to estimate the qualities of an architecture before and after changes; raises BadMessage, OSError."""
        wanted = codec.decode(query.payload, EstimateQualities)
        before, after = (tuple(self._found_here(spec) for spec in specs) for specs in (wanted.before, wanted.after))
        order = {"estimate": codec.to_plain(replace(wanted, before=before, after=after))}
        task = "nothing can be estimated: the process that was to do so"
        self._begin(_Asked(query, task, order, _as_it_is, self._free_file()))

    def _free_file(self) -> Path:
        if len(self._asked) >= MAX_AT_ONCE:
            raise BadMessage(f"{MAX_AT_ONCE} components are being described already: ask again later")
        self._count += 1
        answer = self._folder / f"{DESCRIBE}-{self._count}"
        _remove(answer)  # left by an earlier run of the system
        return answer

    def _begin(self, asked: _Asked) -> None:
        name = f"{DESCRIBE}/{self._count}"  # no component can be named so
        asked.deadline = time.monotonic() + DESCRIBED_TIMEOUT
        self._asked[name] = asked
        order = {**asked.order, "answer": str(asked.answer), "left_out": asked.left_out}
        log = str(self._folder / "logs" / f"{DESCRIBE}.log")
        self._zygote.describe(name, order, str(self._stack_folder), log)

    def _found_here(self, spec: ComponentSpec) -> ComponentSpec:
        return replace(spec, parameters=self._plan.found_here(spec.parameters))

    def _found_there(self, answer: bytes) -> bytes:
        described = codec.decode(answer, DescribedComponent)
        spec = replace(described.spec, parameters=self._plan.found_there(described.spec.parameters))
        return codec.encode(replace(described, spec=spec))

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
        how = f"ended with exit code {code}" if code >= 0 else f"was killed by signal {-code}"
        if asked.late:
            how = f"had not done so after {DESCRIBED_TIMEOUT:g} s"
        try:
            asked.query.reply(asked.reply(asked.answer.read_bytes()))
        except (OSError, SchemaError):
            culprit = _under_way(asked.answer)
            # On a full disk the file is empty: asking again would end in the same way, for ever.
            if culprit and culprit not in asked.left_out and not asked.late and len(asked.left_out) < MAX_LEFT_OUT:
                asked.left_out[culprit] = f"estimate {how}"
                self._count += 1
                self._begin(asked)
                return
            refuse(asked.query, ControlCode.FAILED, f"{asked.task} {how}")
        _remove(asked.answer)

    def look(self, now: float) -> None:
        """Kill processes that take too long."""
        for asked in self._asked.values():
            if now > asked.deadline and asked.pid:
                asked.late = True
                self._zygote.signal(asked.pid, signal.SIGKILL)


def _under_way(answer: Path) -> str:
    """Return the component whose estimator was being called, empty if none is known."""
    try:
        return answer.with_suffix(UNDER_WAY).read_text()
    except (OSError, ValueError):
        return ""


def _remove(answer: Path) -> None:
    """Remove an answer's file and what stands next to it."""
    for file in (answer, answer.with_suffix(UNDER_WAY), Path(f"{answer}.part")):
        with contextlib.suppress(OSError):
            file.unlink()


def _as_it_is(answer: bytes) -> bytes:
    return codec.encode(codec.decode(answer, EstimatedQualities))
