"""Tries the modules that a stack file names, before this process imports them."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.process.trial.trial_import import Notice, try_imports
from regraft.stack.yaml.section import Section


def try_modules(root: Section, notice: Notice) -> frozenset[str]:
    """Note why modules cannot be imported; return those, which nothing may import any more.

    Raises:
        StackError: the import of one has not ended; the others may wait for the same, and are not tried.
    """
    named = list(_named(root))
    tried = try_imports((module for _, module, _ in named), notice)
    for place, module, path in named:
        if module in tried.problems:
            problem = tried.problems[module]
            root.report.add(place, f"{path!r}: {problem}" if path else problem)
    if tried.untried:
        root.report.raise_if_any()
    return frozenset(tried.problems)


def _named(root: Section) -> Iterator[tuple[str, str, str]]:
    """Yield each place that names a module, the module, and the class's path if it names one."""
    for index, module in enumerate(root.texts("imports")):
        yield f"imports.{index}", module, ""
    components = root.section("components")
    for name in components.names():
        path = components.section(name).text("class")
        module, separator, cls = path.partition(":")
        if module and separator and cls:
            yield f"components.{name}.class", module, path
