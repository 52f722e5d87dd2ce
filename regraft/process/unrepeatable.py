"""Notices what makes a run in step another one each time: clocks and random numbers that are not the kit's.

In a component's process, some functions of ``time``, ``random``, ``numpy.random`` and ``uuid`` return something else in
each run. They are replaced by ones that look at their caller, and return what they always did.
"""

from __future__ import annotations

import functools
import importlib
import sys
import sysconfig
import time
from collections.abc import Callable, Iterator
from itertools import takewhile
from types import FrameType, ModuleType
from typing import Any

CLOCK = "self.kit.now()"
CHANCE = "a generator of your own, seeded by self.kit.seed and the component's name"

WATCHED: dict[str, tuple[str, tuple[str, ...]]] = {
    "time": (CLOCK, ("time", "time_ns", "monotonic", "monotonic_ns")),
    "random": (
        CHANCE,
        (
            *(
                "random",
                "uniform",
                "triangular",
                "randint",
                "randrange",
                "getrandbits",
                "randbytes",
                "choice",
                "choices",
            ),
            *("shuffle", "sample", "gauss", "normalvariate", "expovariate", "betavariate", "gammavariate"),
        ),
    ),
    "numpy.random": (
        CHANCE,
        (
            *("rand", "randn", "randint", "random", "random_sample", "ranf", "uniform", "normal", "standard_normal"),
            *("choice", "shuffle", "permutation", "poisson", "exponential", "binomial"),
        ),
    ),
    "uuid": (CHANCE, ("uuid1", "uuid4")),
}
"""Modules, what to use instead, and their functions."""

LIKE_AUTHORS = frozenset(("regraft.services", "regraft.sim_service", "regraft.stacks"))
"""Packages of ours that must not read clocks either; all others of ours read them where no run can notice."""
MAX_TOLD = 20
"""Places that are reported; each costs a line in the log and an event."""

Tell = Callable[[str, int, str, str], object]
"""Is called with a place: its file, line, what is called there, and what to use instead."""
Undo = Callable[[], None]

_found: dict[tuple[str, str], ModuleType] = {}
_newest = ""


def find_uses() -> None:
    """Look through the modules that were imported since the last time for names of what is replaced.

    A process does it before it forks others: to look at what all modules hold writes to the memory that they share.
    """
    global _newest
    watched = {id(value) for value in (time, sys.modules.get("numpy"), *(f for f, *_ in _functions())) if value}
    new = list(takewhile(lambda name: name != _newest, reversed(sys.modules)))
    for module_name in new:
        module = sys.modules[module_name]
        for name, value in list(getattr(module, "__dict__", {}).items()):
            if id(value) in watched:
                _found[module_name, name] = module
    _newest = new[0] if new else _newest


def _functions() -> Iterator[tuple[Callable[..., Any], str, str]]:
    for module_name, (instead, names) in WATCHED.items():
        module = sys.modules.get(module_name)
        for name in names:
            function = getattr(module, name, None)
            if function is not None:
                yield function, f"{module_name}.{name}", instead


def package_of(module: str) -> str:
    """Return the package of a module: within `regraft` its first part, elsewhere the package on top."""
    names = module.split(".")
    return ".".join(names[:2] if names[0] == "regraft" else names[:1])


class Unrepeatable:
    """Watches the calls of authors' code. ``package`` is that of the component's class, wherever it is installed."""

    def __init__(self, package: str, tell: Tell) -> None:
        self._package = package
        self._tell = tell
        self._libraries = tuple(sysconfig.get_path(name) for name in ("purelib", "platlib", "stdlib"))
        self._seen: set[tuple[object, int]] = set()
        self._told = 0

    def watch(self) -> Undo:
        """Replace the functions where authors' modules find them; returns what undoes it.

        The kit and libraries read clocks all the time: for them ``time`` stays as it is.
        """
        find_uses()
        numpy = sys.modules.get("numpy")
        if numpy is not None and any(value is numpy for _, _, value in self._uses()):
            importlib.import_module("numpy.random")  # which numpy imports only when it is wanted
            find_uses()
        functions = {id(f): (f, self._looking(f, *what)) for f, *what in _functions()}
        clock = ModuleType("time", time.__doc__)
        vars(clock).update({name: functions.get(id(value), (0, value))[1] for name, value in vars(time).items()})
        changed: list[tuple[object, str, object]] = []

        def change(module: object, name: str, value: object) -> None:
            changed.append((module, name, getattr(module, name)))
            setattr(module, name, value)

        for module_name in WATCHED.keys() - {"time"}:
            module = sys.modules.get(module_name)
            for name, value in list(vars(module).items()) if module else []:
                if id(value) in functions:
                    change(module, name, functions[id(value)][1])
        for module, name, value in self._uses():
            if value is time:
                change(module, name, clock)
            elif id(value) in functions:
                change(module, name, functions[id(value)][1])

        def undo() -> None:
            for one in changed:
                setattr(*one)

        return undo

    def _uses(self) -> list[tuple[ModuleType, str, Any]]:
        """Return where authors' modules have what is replaced: module, name there, and value."""
        return [
            (module, name, getattr(module, name, None))
            for (_, name), module in _found.items()
            if self._is_authored(getattr(module, "__name__", ""), getattr(module, "__file__", None))
        ]

    def _looking(self, original: Callable[..., Any], name: str, instead: str) -> Callable[..., Any]:
        seen = self._seen

        @functools.wraps(original)
        def call(*args: Any, **kwargs: Any) -> Any:
            frame = sys._getframe(1)
            if (frame.f_code, frame.f_lasti) not in seen:
                self._look(frame, name, instead)
            return original(*args, **kwargs)

        return call

    def _look(self, frame: FrameType, name: str, instead: str) -> None:
        """Report a place, the first time that it is come by."""
        self._seen.add((frame.f_code, frame.f_lasti))
        file = frame.f_code.co_filename
        if self._told < MAX_TOLD and self._is_authored(frame.f_globals.get("__name__", ""), file):
            self._told += 1
            self._tell(file, frame.f_lineno, name, instead)

    def _is_authored(self, module: str, file: str | None) -> bool:
        package = package_of(module)
        if package.partition(".")[0] == "regraft" and package not in LIKE_AUTHORS:
            return False
        if package == self._package:
            return True
        if package in sys.stdlib_module_names or file is None:
            return False
        return not file.startswith(self._libraries) and not file.startswith("<")
