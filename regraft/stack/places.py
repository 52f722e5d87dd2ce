"""Places components of a stack on hosts, from the command line; checked as the stack itself is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from regraft.bus_schema import keys
from regraft.bus_schema.errors import BadKey
from regraft.bus_schema.suggestions import instead_of
from regraft.stack.checks import stack_problems
from regraft.stack.stack import Stack
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
            problems.append(Problem(f"placement {text[:200]}", None, "", problem))
            continue
        spec = architecture.components[component]
        architecture = architecture.with_hosts([host]).with_component(replace(spec, host=host))
    found = stack_problems(architecture) if places and not problems else ()
    problems += [Problem(str(stack.file), stack.lines.get(place), place, problem) for place, problem in found]
    if problems:
        raise StackError(problems)
    return replace(stack, architecture=architecture)


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
