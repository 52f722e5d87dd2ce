"""Places components of a stack on hosts, from the command line; checked as the stack itself is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from regraft.bus_schema import keys
from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.checks import file_problems_of, stack_problems
from regraft.stack.sections.hosts import FIRST
from regraft.stack.stack import Stack
from regraft.stack.yaml.nodes import Location, Node
from regraft.stack.yaml.problems import Problem, StackError


def with_places(stack: Stack, places: Sequence[str]) -> Stack:
    """Return the stack with components on the hosts that ``component=host`` names, which need not be in the file.

    Raises:
        StackError: with everything that is wrong, each naming the placement.
    """
    architecture, problems = stack.architecture, []
    for text in places:
        component, _, host = text.partition("=")
        problem = _problem(stack, component, host)
        if problem:
            problems.append(Problem(_shown(text), None, "", problem))
            continue
        spec = architecture.components[component]
        architecture = architecture.with_hosts([host]).with_component(replace(spec, host=host))
        stack = _written(stack, component, Node(host, Location(_shown(text))))
    if places and not problems:
        problems += [stack.problem(place, problem) for place, problem in stack_problems(architecture)]
        if problems or not stack.files_later:
            problems += [stack.problem(place, problem) for place, problem in file_problems_of(architecture)]
    if problems:
        raise StackError(problems)
    return replace(stack, architecture=architecture)


def _shown(text: str) -> str:
    return f"placement {text[:200]}"


def _written(stack: Stack, component: str, host: Node) -> Stack:
    """Return the stack with a host in its document."""
    stack = stack.with_field(("components", component, "host"), host)
    assert isinstance(stack.document.value, dict)
    hosts = stack.document.value.get("hosts", Node((), host.location))
    if host.value == FIRST:
        return stack
    if isinstance(hosts.value, tuple):
        known = [part.value for part in hosts.value]
        more = hosts if host.value in known else Node((*hosts.value, host), hosts.location)
        return stack.with_field(("hosts",), more)
    if isinstance(hosts.value, dict) and host.value not in hosts.value:
        return stack.with_field(("hosts", str(host.value)), Node({}, host.location))
    return stack


def _problem(stack: Stack, component: str, host: str) -> str:
    components = stack.architecture.components
    if not component or not host:
        return "must look like 'component=host'"
    if component not in components:
        return f"there is no component {component!r}; {instead_of(component, components)}"
    try:
        keys.host_name(host)
    except BadKey as error:
        return str(error)
    return ""
