"""``connect``: a port moves to another topic or to none, in the spec and, while messages flow, in the component."""

from __future__ import annotations

from dataclasses import replace

from regraft.adaptation_manager.steps.actions import ConnectPort, PlannedStep
from regraft.adaptation_manager.steps.draft import Draft
from regraft.bus_schema.model.adaptation import Connect


def plan(draft: Draft, change: Connect) -> None:
    """Add the change to the draft. Ports, topics and types are judged on the resulting architecture."""
    spec = draft.spec(change.component)
    draft.update(replace(spec, connections={**spec.connections, change.port: change.topic}))
    live = draft.live.get(change.component)
    if live is None:
        return
    former = live.connections.get(change.port, "")
    # An unconfigured component has no connections; it gets the spec's when it is configured.
    if former in ("", change.topic):
        return
    if change.topic is None:
        text = f"disconnect {change.port} (from {former})"
    else:
        text = f"connect {change.port} to {change.topic} (from {former or 'no topic'})"
    draft.steps.append(
        PlannedStep(
            change.component,
            text,
            ConnectPort(change.component, change.port, change.topic),
            ConnectPort(change.component, change.port, former),
        )
    )
    draft.live[change.component] = replace(live, connections={**live.connections, change.port: change.topic})
