"""Changes to a stack from the command line, checked as the stack itself is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from regraft.bus_schema import keys
from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.constraints import split_parameter
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.checks import file_problems_of, stack_problems
from regraft.stack.classes import describe_class
from regraft.stack.relative_paths import with_absolute_paths
from regraft.stack.sections.components import connections
from regraft.stack.stack import Stack, time_source
from regraft.stack.yaml.document import parse
from regraft.stack.yaml.nodes import Location, Node, NumberTooLarge, moved, plain, scalar
from regraft.stack.yaml.problems import Problem, StackError, fail


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter's new value, with where it is given; a relative path is looked for from ``folder``."""

    component: str
    parameter: str
    value: Node
    folder: Path

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of the field in the stack's document."""
        return ("components", self.component, "parameters", self.parameter)


def apply_overrides(stack: Stack, overrides: Sequence[str]) -> Stack:
    """Return the stack with parameters set by ``component.parameter=value``.

    Of several for one parameter the last holds. The value is a YAML scalar, or a list as ``[1, 2]``. A
    relative path is looked for in the current folder.

    Raises:
        StackError: with everything that is wrong, each naming the override.
    """
    problems: list[Problem] = []
    read: list[Setting] = []
    for text in overrides:
        try:
            read.append(_read(stack, text))
        except StackError as error:
            problems += error.problems
    return apply_settings(stack, read, problems)


def apply_settings(stack: Stack, settings: Sequence[Setting], problems: Sequence[Problem] = ()) -> Stack:
    """Return the stack with parameters set, the last of several for one; ``problems`` are of those not among them.

    Raises:
        StackError: with everything that is wrong, each naming where the value is given.
    """
    architecture, problems = stack.architecture, list(problems)
    for setting in settings:
        stack = stack.with_field(setting.keys, setting.value)
        architecture = _set(architecture, setting)
    for name in dict.fromkeys(setting.component for setting in settings):
        spec, wrong = _described_anew(architecture, architecture.components[name])
        architecture = architecture.with_component(spec)
        problems += [stack.problem(f"components.{name}.parameters.{place}", why) for place, why in wrong]
    problems += [
        stack.problem(".".join(setting.keys), f"there is no such parameter: {setting.component!r} has none")
        for setting in settings
        if stack.architecture.components[setting.component].description is None
    ]
    problems += [stack.problem(place, problem) for place, problem in stack_problems(architecture)]
    if problems or not stack.files_later:
        problems += [stack.problem(place, problem) for place, problem in file_problems_of(architecture)]
    if problems:
        raise StackError(problems)
    return replace(stack, architecture=architecture)


def with_seed(stack: Stack, seed: int) -> Stack:
    """Return the stack with another seed; raises StackError."""
    if not 0 <= seed < 2**63:
        fail("seed", None, f"{seed}: must be from 0 to {2**63 - 1}")
    return replace(stack, seed=seed)


def with_speed(stack: Stack, speed: str) -> Stack:
    """Return the stack with another speed of simulated time, ``real`` or ``max``; raises StackError."""
    source = time_source(stack)
    if source is None:
        fail("speed", None, f"{stack.name!r} runs under the real clock: only simulated time has a speed")
    return apply_overrides(stack, [f"{source}.speed={speed}"])


def with_system(stack: Stack, system: str) -> Stack:
    """Return the stack under another system name; raises StackError."""
    try:
        keys.system_name(system)
    except BadKey as error:
        fail("system", None, str(error))
    return replace(stack, architecture=replace(stack.architecture, system=system))


def _shown(text: str) -> str:
    return f"--set {text[:200]}"


def _read(stack: Stack, text: str) -> Setting:
    path, equals, value = text.partition("=")
    component, parameter = split_parameter(path.strip())
    if not equals or not component or not parameter:
        fail(_shown(text), None, "must look like 'component.parameter=value'")
    components = stack.architecture.components
    if component not in components:
        fail(_shown(text), None, f"there is no component {component!r}; {instead_of(component, components)}")
    return Setting(component, parameter, _value(text, value.strip()), Path.cwd())


def _value(text: str, value: str) -> Node:
    location = Location(_shown(text))
    try:
        if value[:1] not in ("[", "'", '"'):
            return Node(scalar(value), location)
        return moved(parse(value, _shown(text)), location)
    except NumberTooLarge as error:
        fail(_shown(text), None, str(error))


def _set(architecture: Architecture, setting: Setting) -> Architecture:
    spec = architecture.components[setting.component]
    value = {setting.parameter: plain(setting.value)}
    if spec.description:
        value = with_absolute_paths(spec.description, value, setting.folder)
    return architecture.with_component(replace(spec, parameters={**spec.parameters, **value}))


def _described_anew(
    architecture: Architecture, spec: ComponentSpec
) -> tuple[ComponentSpec, tuple[tuple[str, str], ...]]:
    """Return the spec with the ports that its parameters now ask for, and what is wrong with those."""
    if not spec.cls or spec.description is None:
        return spec, ()
    description, wrong = describe_class(spec.cls, spec.parameters)
    if wrong or description == spec.description:  # the ports of wrong parameters are unknown: those before stay
        return spec, wrong
    before = connections(spec, architecture, {})
    given = {
        port.name: spec.connections[port.name]
        for port in description.ports
        if port.name in spec.connections and spec.connections[port.name] != before.get(port.name, "")
    }
    spec = replace(spec, description=description)
    return replace(spec, connections=connections(spec, architecture, given)), wrong
