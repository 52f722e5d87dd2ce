"""What a component would be that is not there yet: its class is imported and asked in a process of its own.

An author's module may hang, exit or crash while it is imported: neither the host nor the manager takes part in that.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import shutil
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bus_schema import codec
from bus_schema.adaptation import Violation
from bus_schema.annotations import PlainValue
from bus_schema.architecture import ComponentSpec
from bus_schema.errors import BadMessage, SchemaError
from bus_schema.messages.control import ControlCode
from bus_schema.messages.host import DescribeComponent, DescribedComponent
from regraft.bus import Query
from regraft.host.voice import refuse
from regraft.process import NoSuchClass, load_class
from regraft.stack.classes import describe_class
from regraft.stack.components import in_run_folder, with_absolute_paths
from regraft.stack.files import file_problems
from regraft.stepped.source import TimeSource

if TYPE_CHECKING:
    from regraft.host.zygote import Zygote

DESCRIBE = "describe"
DESCRIBED_WITHIN = 20.0
"""Seconds that importing and describing a class may take."""
MOST_AT_ONCE = 16


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

    def __init__(self, zygote: Zygote, stack_folder: Path, folder: Path) -> None:
        """Nothing has been asked; ``folder`` is the running system's."""
        self._zygote = zygote
        self._stack_folder = stack_folder
        self._folder = folder
        self._asked: dict[str, _Asked] = {}
        self._count = 0

    def ask(self, query: Query) -> None:
        """Begin to answer a query; raises BadMessage, OSError."""
        wanted = codec.decode(query.payload, DescribeComponent)
        spec = wanted.spec
        if len(self._asked) >= MOST_AT_ONCE:
            raise BadMessage(f"{MOST_AT_ONCE} components are being described already: ask again later")
        self._count += 1
        name = f"{DESCRIBE}/{self._count}"  # no component can be named so
        answer = self._folder / f"{DESCRIBE}-{self._count}"
        order = {
            "spec": codec.to_plain(spec),
            "context": wanted.context,
            "answer": str(answer),
            "stack_folder": str(self._stack_folder),
            "folder": str(self._folder),
        }
        log = str(self._folder / "logs" / f"{DESCRIBE}.log")
        self._asked[name] = _Asked(query, spec, answer, time.monotonic() + DESCRIBED_WITHIN)
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
                how = f"had not done so after {DESCRIBED_WITHIN:g} s"
            problem = f"{asked.spec.cls!r} cannot be described: the process that was to import it {how}"
            refuse(asked.query, ControlCode.FAILED, problem)
        else:
            asked.query.reply(codec.encode(described))
        finally:
            with contextlib.suppress(OSError):
                asked.answer.unlink()

    def look(self, now: float) -> None:
        """Kill whoever takes too long."""
        for asked in self._asked.values():
            if now > asked.deadline and asked.pid:
                asked.late = True
                self._zygote.signal(asked.pid, signal.SIGKILL)


def be_describer(order: dict[str, Any]) -> int:
    """Write what a spec would be to the file that the order names; for a process of its own."""
    spec = codec.from_plain(order["spec"], ComponentSpec)
    described = describe_component(spec, Path(order["stack_folder"]), order["folder"], order["context"])
    partial = f"{order['answer']}.part"
    Path(partial).write_bytes(codec.encode(described))
    os.replace(partial, order["answer"])
    return 0


def describe_component(
    spec: ComponentSpec, stack_folder: Path, folder: str, context: dict[str, PlainValue] | None = None
) -> DescribedComponent:
    """Return a spec with what its class says, as a stack file's component would have it, and what is wrong with it.

    A relative path is looked for from ``stack_folder``; ``$RUN`` is ``folder``.
    """
    if not spec.cls:
        return DescribedComponent(in_run_folder(spec, folder), tuple(_program_problems(spec)))
    try:
        description, problems = describe_class(spec.cls, spec.parameters)
    except NoSuchClass as error:
        return DescribedComponent(spec, (Violation(None, spec.name, "cls", str(error)),))
    found = [Violation(None, spec.name, f"parameters.{place}", why) for place, why in problems]
    if issubclass(load_class(spec.cls), TimeSource):
        problem = f"{spec.cls!r} makes simulated time go on: a system has one source of time, from its start"
        found.append(Violation(None, spec.name, "cls", problem))
    completed = replace(
        spec,
        description=description,
        parameters=with_absolute_paths(description, dict(spec.parameters), stack_folder),
        services={offered.name: offered.name for offered in description.services} | spec.services,
    )
    found += [
        Violation(None, spec.name, f"parameters.{name}", problem)
        for name, problem in file_problems(description, completed.parameters)
    ]
    estimated = {} if found else _estimated(completed, context or {})
    return DescribedComponent(in_run_folder(completed, folder), tuple(found), estimated)


def _estimated(spec: ComponentSpec, context: dict[str, PlainValue]) -> dict[str, float]:
    """Return what qualities a class says it would give; one that fails at that can run nevertheless."""
    described = spec.description.parameters if spec.description else ()
    parameters = {parameter.name: parameter.default for parameter in described} | spec.parameters
    try:
        told = load_class(spec.cls).estimate(parameters, context)
        return {str(name): float(value) for name, value in told.items() if math.isfinite(value)}
    except Exception:
        logging.getLogger(__name__).exception("%s: the qualities of %s", spec.name, spec.cls)
        return {}


def _program_problems(spec: ComponentSpec) -> list[Violation]:
    if not spec.command or shutil.which(spec.command[0]):
        return []
    problem = f"there is no program {spec.command[0]!r} that can be run"
    return [Violation(None, spec.name, "command", problem)]
