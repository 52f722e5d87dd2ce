"""Tries the modules that a stack file names, before this process imports them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

from regraft.process.modules import hidden_in
from regraft.process.trial.trial_import import Notice, try_imports
from regraft.stack.classes import device_classes
from regraft.stack.sections.hosts import FIRST
from regraft.stack.yaml.nodes import Location, Node, plain
from regraft.stack.yaml.section import Section


def try_modules(root: Section, folders: Collection[Path], notice: Notice) -> frozenset[str]:
    """Note why modules cannot be imported, or are hidden; return those, which nothing may import any more.

    A module next to the file that names it may be hidden by one in another of the ``folders``.

    Raises:
        StackError: the import of one has not ended; the others may wait for the same, and are not tried.
    """
    named: dict[tuple[Location, str], tuple[str, str]] = {}
    for place, module, path in _named(root):
        # Several components take the same robots, whose devices are named once.
        named.setdefault((root.report.location_of(place), module), (place, path))
    tried = try_imports((module for _, module in named), notice)
    refused: set[str] = set()
    for (location, module), (place, path) in named.items():
        problem = tried.problems.get(module) or (hidden_in(location.folder, module, folders) if path else "")
        if problem:
            root.report.add(place, f"{path!r}: {problem}" if path else problem)
            refused.add(module)
    if tried.untried:
        root.report.raise_if_any()
    return frozenset(refused)


def _named(root: Section) -> Iterator[tuple[str, str, str]]:
    """Yield each place that names a module, the module, and the class's path if it names one."""
    for index, module in enumerate(root.texts("imports")):
        yield f"imports.{index}", module, ""
    for place, path in _classes(root):
        module, separator, cls = path.partition(":")
        if module and separator and cls:
            yield place, module, path


def _classes(root: Section) -> Iterator[tuple[str, str]]:
    """Yield each place that names the class of a component or of a robot's device, and the class's path."""
    components = root.section("components")
    for name in components.names():
        component = components.section(name)
        yield f"components.{name}.class", component.text("class")
        given = component.node("parameters")
        for place, path in device_classes(plain(given) if given is not None else None):
            yield f"components.{name}.parameters.{place}", path
    modes = root.node("modes")
    for mode, node in modes.value.items() if modes is not None and isinstance(modes.value, dict) else ():
        for index, change in enumerate(node.value if isinstance(node.value, tuple) else ()):
            yield from _classes_in_mode(change, f"modes.{mode}.{index}", components)


def _classes_in_mode(change: Node, place: str, components: Section) -> Iterator[tuple[str, str]]:
    """Yield the classes that a change of a mode gives to a component of this machine: other hosts have their own."""
    given = plain(change)
    if not isinstance(given, dict):
        return
    own = components.node(str(given.get("component")))
    swapped = plain(own) if own is not None else None
    for spec, at, of in ((given, place, swapped), (given.get("spec"), f"{place}.spec", given.get("spec"))):
        if not isinstance(spec, dict) or not isinstance(of, dict) or of.get("host", FIRST) != FIRST:
            continue
        if isinstance(path := spec.get("class"), str):
            yield f"{at}.class", path
        for below, path in device_classes(spec.get("parameters")):
            yield f"{at}.parameters.{below}", path
