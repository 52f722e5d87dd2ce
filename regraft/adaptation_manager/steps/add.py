"""``add``: a component's process is started next to the running system, and takes part when it is its turn."""

from __future__ import annotations

from dataclasses import replace

from regraft.adaptation_manager.steps.actions import Activate, EndProcess, PlannedStep, RunProcess
from regraft.adaptation_manager.steps.draft import Draft
from regraft.bus_schema.messages.protocol.control import ComponentView
from regraft.bus_schema.model.adaptation import Add
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.modes.mode_deciders import fed_as_needed
from regraft.stack.sections.components import connections, services


def plan(draft: Draft, change: Add) -> None:
    """Add the change to the draft, with the spec as the component's host describes it."""
    name = change.component
    if name in draft.removed:
        draft.refuse(name, "component", "is removed in the same request: exchanging a component is a swap")
    elif name in draft.architecture.components:
        draft.refuse(name, "component", "there is a component of this name already: add it under another")
    elif change.spec.name not in ("", name):
        draft.refuse(name, "spec.name", f"is {change.spec.name!r}, must be {name!r} or left out")
    described = draft.described.get(draft.index or 0)
    _add_topics(draft, change)
    if name in draft.architecture.components:
        return
    if described is None or described.violations:
        draft.unclear.add(name)
        return
    spec = replace(described.spec, name=name)
    spec = replace(
        spec,
        connections=connections(spec, draft.architecture, spec.connections),
        services=services(spec, draft.architecture, change.spec.services),
    )
    spec = fed_as_needed(spec, change.spec.connections, draft.architecture)
    draft.update(spec)
    draft.added.add(name)
    if spec.managed:
        _plan_component(draft, spec, change.resume)
    else:
        draft.steps.append(_started(spec, State.UNCONFIGURED, change.resume))


def _add_topics(draft: Draft, change: Add) -> None:
    known = draft.architecture.topics
    for topic in change.topics:
        if known.get(topic.name, topic) != topic:
            problem = f"there is such a topic already, and it is another: {known[topic.name]}"
            draft.refuse(change.component, f"topics.{topic.name}", problem)
    new = [topic for topic in change.topics if topic.name not in known]
    draft.architecture = draft.architecture.with_topics(new)


def _plan_component(draft: Draft, spec: ComponentSpec, resume: bool) -> None:
    prepared = State.UNCONFIGURED if spec.state is State.UNCONFIGURED else State.INACTIVE
    draft.preparing.append(_started(spec, prepared, resume))
    if spec.state is State.ACTIVE:
        draft.steps.append(
            PlannedStep(spec.name, "connect and activate", Activate(spec.name), EndProcess(spec.name, spec.host))
        )
    defaults = {p.name: p.default for p in spec.description.parameters} if spec.description else {}
    ports = [port.name for port in spec.description.ports] if spec.description else []
    configured = spec.state is not State.UNCONFIGURED
    draft.live[spec.name] = ComponentView(
        spec.name,
        0,
        spec.state,
        0,
        {**defaults, **spec.parameters},
        {port: spec.connections.get(port, "") if configured else "" for port in ports},
    )


def _started(spec: ComponentSpec, state: State, resume: bool) -> PlannedStep:
    what = spec.cls or " ".join(spec.command)
    return PlannedStep(
        spec.name,
        f"start {what} on {spec.host}" + (f", {state.value}" if spec.managed else ""),
        RunProcess(spec.name, spec, state, resume),
        EndProcess(spec.name, spec.host),
    )
