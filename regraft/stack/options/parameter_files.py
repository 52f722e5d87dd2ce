"""Sets parameters of a stack from files of their own, checked as the stack itself is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from regraft.bus_schema.suggestions import instead_of
from regraft.stack.options.overrides import Setting, apply_settings
from regraft.stack.stack import Stack
from regraft.stack.yaml.document import read_map
from regraft.stack.yaml.nodes import Node
from regraft.stack.yaml.problems import Report, StackError


def apply_parameter_files(stack: Stack, files: Sequence[Path]) -> Stack:
    """Return the stack with the parameters of files, a later one over an earlier one.

    A file is a map ``component: {parameter: value}``. A relative path is looked for from the file's folder.

    Raises:
        StackError: with everything that is wrong, each with file and line.
    """
    if not files:
        return stack
    report = Report(str(stack.file))
    settings: list[Setting] = []
    for file in files:
        try:
            settings += _settings(stack, read_map(file, "component names"), report)
        except StackError as error:
            report.problems += error.problems
    return apply_settings(stack, settings, report.problems)


def _settings(stack: Stack, document: Node, report: Report) -> Iterator[Setting]:
    assert isinstance(document.value, dict)
    components = stack.architecture.components
    for component, parameters in document.value.items():
        if component not in components:
            problem = f"there is no component {component!r}; {instead_of(component, components)}"
            report.add_at(parameters.location, component, problem)
        elif not isinstance(parameters.value, dict):
            report.add_at(parameters.location, component, f"must be a map of parameters, is {parameters.kind}")
        else:
            for name, value in parameters.value.items():
                yield Setting(component, name, value, value.location.folder)
