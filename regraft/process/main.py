"""The process of one component: from its assignment to its end, which is clean in any case."""

from __future__ import annotations

import gc
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable

from regraft.bus.interface import BusError
from regraft.bus.zenoh_bus import open_bus
from regraft.bus.zenoh_config import Endpoints
from regraft.bus_schema.encoding.registry import TYPE_NAME, known_types
from regraft.bus_schema.errors import SchemaError
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.suggestions import instead_of, near
from regraft.component.component import Component
from regraft.component.parameters import ParameterError
from regraft.lockstep.member import Member
from regraft.lockstep.source import SourceLoop, TimeSource
from regraft.process.malloc import keep_freed_memory
from regraft.process.modules import CannotImport, hidden_by_another, imported
from regraft.process.shutdown import ShutdownRequest
from regraft.process.unrepeatable import Unrepeatable, package_of
from regraft.process.zenoh_threads import have_one_thread_read
from regraft.runtime import loop
from regraft.runtime.core.assignment import Assignment
from regraft.runtime.core.clock import RealClock, SteppedClock
from regraft.runtime.core.lease import HeldLease
from regraft.runtime.runtime import Runtime

LEAVE_TIMEOUT = 3.0
"""Seconds after which a process that is leaving the bus leaves by force."""

EXIT_WELL, EXIT_FAULT, EXIT_BAD_ASSIGNMENT = 0, 1, 2


def how_it_ended(code: int) -> str:
    """Return an exit code in words: ``exit code 2`` or ``killed by SIGKILL``."""
    if code >= 0:
        return f"exit code {code}"
    try:
        return f"killed by {signal.Signals(-code).name}"
    except ValueError:
        return f"killed by signal {-code}"


class NoSuchClass(Exception):
    """``module:Class`` does not name a component class; the text states what is wrong."""


def load_class(path: str) -> type[Component]:
    """Return the component class at ``module:Class``; raises NoSuchClass."""
    module_name, separator, class_name = path.partition(":")
    if not separator or not module_name or not class_name:
        hint = "; message types belong to topics" if TYPE_NAME.fullmatch(path) else ""
        raise NoSuchClass(f"{path!r} must look like 'package.module:Class'{hint}")
    try:
        module = imported(module_name)
    except CannotImport as error:
        raise NoSuchClass(f"{path!r}: {error}") from error
    cls = getattr(module, class_name, None)
    if cls is None:
        there = [
            name for name, value in vars(module).items() if _is_component(value) and value.__module__ == module_name
        ]
        hidden = "" if near(class_name, there) else hidden_by_another(module_name)
        hint = hidden or instead_of(class_name, there, none="it has no component class")
        raise NoSuchClass(f"{path!r}: {module_name!r} has no class {class_name!r}; {hint}")
    if not _is_component(cls):
        raise NoSuchClass(f"{path!r} is no subclass of regraft.Component{_what_else(module_name, cls)}")
    found: type[Component] = cls
    return found


def _what_else(module_name: str, value: object) -> str:
    kind = next((kind for kind in known_types() if kind.cls is value), None)
    if kind is not None:
        return f": it is the message type {kind.name!r}, which belongs to topics"
    hidden = hidden_by_another(module_name)
    return f"; {hidden}" if hidden else ""


def _is_component(value: object) -> bool:
    return isinstance(value, type) and issubclass(value, Component)


def run_component(
    assignment: Assignment, ending: ShutdownRequest | None = None, on_bus: Callable[[], object] = lambda: None
) -> int:
    """Be the component of ``assignment`` until it is finalized, or ``ending`` is wanted; returns the exit code.

    Without an ``ending``, SIGINT, SIGTERM and SIGHUP are heard from when the component is built. ``on_bus`` is called
    once others can be linked, just before it starts; what that raises, this does.
    """
    keep_freed_memory()
    try:
        cls = _prepared(assignment.cls)
        lockstep = assignment.simulated and cls.lockstep
        router = bool(assignment.listen_endpoints)
        if not router:
            have_one_thread_read()
        endpoints = Endpoints(
            assignment.listen_endpoints, assignment.connect_endpoints, router, secret=assignment.secret
        )
        bus = open_bus(endpoints, lockstep=assignment.simulated)
    except (NoSuchClass, BusError) as error:
        print(f"{assignment.name}: {error}", file=sys.stderr)
        return EXIT_BAD_ASSIGNMENT
    clock = SteppedClock(_begin_at(assignment)) if lockstep else RealClock()
    try:
        runtime = Runtime(cls, assignment, bus, clock)
    except (ParameterError, SchemaError) as error:
        print(f"{assignment.name}: {error}", file=sys.stderr)
        bus.close()
        return EXIT_BAD_ASSIGNMENT
    if lockstep:
        _watch_for_what_is_not_repeatable(runtime)
    if assignment.lease:
        runtime.writers.lease = HeldLease(assignment.name, assignment.lease)
    if ending is None:
        ending = ShutdownRequest()
        ending.hear_signals()
    ending.when_wanted(lambda: runtime.post(lambda: runtime.lifecycle.reach(State.FINALIZED)))
    try:
        on_bus()
        return _run(runtime, clock)
    finally:
        _leave(runtime)


def _watch_for_what_is_not_repeatable(runtime: Runtime) -> None:
    """Report, as an event and in the log, where a lockstep component reads clocks and chance outside the kit."""

    def tell(file: str, line: int, name: str, instead: str) -> None:
        text = f"{file}:{line}: {name} gives something else in each run: use {instead}"
        print(text, file=sys.stderr)
        runtime.post(lambda: runtime.reporter.event("component.unrepeatable", text, file=file, line=line, call=name))

    Unrepeatable(package_of(runtime.assignment.cls.partition(":")[0]), tell).watch()


def _prepared(path: str) -> type[Component]:
    """Return a component class, prepared as the zygote does it if that does not know the class; raises NoSuchClass."""
    known = path.partition(":")[0] in sys.modules
    cls = load_class(path)
    if not known:
        notice = cls.preload()
        if notice:
            print(notice, file=sys.stderr)
        gc.freeze()
    return cls


def _begin_at(assignment: Assignment) -> int:
    """Return the simulated time at which a run begins: that of its checkpoint, so that time never goes back."""
    return round(assignment.checkpoint.stamp * 1e9) if assignment.checkpoint else 0


def _run(runtime: Runtime, clock: RealClock | SteppedClock) -> int:
    try:
        if isinstance(clock, RealClock):
            loop.run(runtime)
        elif isinstance(runtime.component, TimeSource):
            SourceLoop(runtime, clock, runtime.component).run()
        else:
            Member(runtime, clock).run()
    except Exception:
        logging.getLogger(runtime.assignment.name).exception("the kit failed")
        return EXIT_FAULT
    return EXIT_WELL


def _leave(runtime: Runtime) -> None:
    """Leave the bus; a link that hangs cannot keep the process alive."""
    by_force = threading.Timer(LEAVE_TIMEOUT, lambda: os._exit(EXIT_FAULT))
    by_force.daemon = True
    by_force.start()
    try:
        runtime.leave()
    finally:
        runtime.bus.close()
        by_force.cancel()
