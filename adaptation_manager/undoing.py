"""Undoing an applied adaptation: the changes that lead back, and what stands in their way."""

from __future__ import annotations

from collections.abc import Sequence

from bus_schema.adaptation import AdaptationReport, Change, ChangeState, Connect, SetParameters, Violation
from bus_schema.architecture import Architecture, ComponentSpec
from bus_schema.lifecycle import State, after, route


def inverse(changes: Sequence[Change], before: Architecture) -> tuple[Change, ...]:
    """Return the changes that lead from behind ``changes`` back to the architecture ``before`` them."""
    states: dict[str, State] = {}
    back: list[tuple[Change, ...]] = []
    for change in changes:
        spec = before.components[change.component]
        if isinstance(change, SetParameters):
            values = {name: _parameter(spec, name) for name in change.parameters}
            back.append((SetParameters(spec.name, values),))
        elif isinstance(change, Connect):
            back.append((Connect(spec.name, change.port, _topic(spec, change.port)),))
        elif isinstance(change, ChangeState):
            start = states.get(spec.name, spec.state)
            end = after(start, change.transition) or start
            states[spec.name] = end
            back.append(tuple(ChangeState(spec.name, transition) for transition in route(end, start) or ()))
    return tuple(change for changes_back in reversed(back) for change in changes_back)


def touched(changes: Sequence[Change]) -> set[tuple[str, str]]:
    """Return the (component, field) pairs that ``changes`` decide on."""
    pairs: set[tuple[str, str]] = set()
    for change in changes:
        if isinstance(change, SetParameters):
            pairs |= {(change.component, f"parameters.{name}") for name in change.parameters}
        elif isinstance(change, Connect):
            pairs.add((change.component, f"connections.{change.port}"))
        else:
            pairs.add((change.component, "state"))
    return pairs


def conflicts(
    report: AdaptationReport, behind: Architecture, now: Architecture, later: Sequence[AdaptationReport]
) -> list[Violation]:
    """Return what later adaptations decided otherwise, naming each.

    What is still, or again, as it was given is no conflict.

    ``behind`` is the architecture that the adaptation to be undone gave, ``now`` the current one.
    """
    found = []
    for component, where in sorted(touched(report.request.changes)):
        given, current = _value(behind, component, where), _value(now, component, where)
        if given == current:
            continue
        others = [other.id for other in later if (component, where) in touched(other.request.changes)]
        problem = (
            f"was changed again by adaptation {', '.join(others)}: it is {current!r}, "
            f"adaptation {report.id} gave {given!r}; undo the later one first"
        )
        found.append(Violation(None, component, where, problem))
    return found


def _value(architecture: Architecture, component: str, where: str) -> object:
    spec = architecture.components.get(component)
    if spec is None:
        return None
    kind, _, name = where.partition(".")
    if kind == "parameters":
        return _parameter(spec, name)
    return _topic(spec, name) if kind == "connections" else spec.state.value


def _parameter(spec: ComponentSpec, name: str) -> object:
    described = spec.description.parameter(name) if spec.description else None
    return spec.parameters.get(name, described.default if described else None)


def _topic(spec: ComponentSpec, port: str) -> str:
    described = spec.description.port(port) if spec.description else None
    return spec.connections.get(port, described.topic if described else "")
