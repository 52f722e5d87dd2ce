"""An architecture as changes would leave it, where nothing runs: what a candidate is, without carrying anything out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from regraft.bus_schema.model.adaptation import (
    Add,
    Change,
    ChangeState,
    Connect,
    EnterMode,
    Move,
    Remove,
    SetParameters,
    Swap,
)
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.lifecycle import after, legal
from regraft.stack.sections.components import connections, services
from regraft.stack.successor import successor

Describe = Callable[[ComponentSpec], ComponentSpec]
"""Gives a spec with the description of its class."""


class CannotChange(ValueError):
    """A change that the architecture cannot have; the text states why."""


def changed(architecture: Architecture, changes: Sequence[Change], describe: Describe) -> Architecture:
    """Return the architecture after ``changes``, in their order; those of a mode have to be in its place.

    Names and values are taken as they are: they have been checked. The revision stays.

    Raises:
        CannotChange: a transition is not legal by then, or a component is not there.
    """
    for change in changes:
        architecture = _after(architecture, change, describe)
    return architecture


def _after(architecture: Architecture, change: Change, describe: Describe) -> Architecture:
    if isinstance(change, EnterMode):
        raise CannotChange(f"mode {change.mode!r}: name the changes of the mode in its place")
    if isinstance(change, Add):
        return _with_added(architecture, change, describe)
    spec = architecture.components.get(change.component)
    if spec is None:
        raise CannotChange(f"{change.component}: is not there by then")
    if isinstance(change, Remove):
        return architecture.without({spec.name}).with_topics((), change.topics)
    return architecture.with_component(_spec_after(architecture, spec, change, describe))


def _spec_after(
    architecture: Architecture,
    spec: ComponentSpec,
    change: SetParameters | Connect | ChangeState | Swap | Move,
    describe: Describe,
) -> ComponentSpec:
    if isinstance(change, SetParameters):
        return replace(spec, parameters={**spec.parameters, **change.parameters})
    if isinstance(change, Connect):
        return replace(spec, connections={**spec.connections, change.port: change.topic})
    if isinstance(change, Move):
        return replace(spec, host=change.host)
    if isinstance(change, Swap):
        parameters = spec.parameters | change.parameters
        new = describe(replace(spec, cls=change.cls or spec.cls, parameters=parameters, description=None))
        return successor(change, spec, new, architecture)
    state = after(spec.state, change.transition)
    if state is None:
        possible = ", ".join(each.value for each in legal(spec.state)) or "none"
        raise CannotChange(
            f"{spec.name}: {change.transition.value} is not possible while {spec.state.value}; possible: {possible}"
        )
    return replace(spec, state=state)


def _with_added(architecture: Architecture, change: Add, describe: Describe) -> Architecture:
    if change.component in architecture.components:
        raise CannotChange(f"{change.component}: there is a component of this name already")
    architecture = architecture.with_topics(change.topics)
    spec = describe(replace(change.spec, name=change.component, description=None))
    return architecture.with_component(
        replace(
            spec,
            connections=connections(spec, architecture, spec.connections),
            services=services(spec, architecture, change.spec.services),
        )
    )
