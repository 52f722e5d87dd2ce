"""``remove``: a component is deactivated at its turn; once the adaptation is applied, its process ends.

Until then it is only still, with all that it knows, and keeps what comes for it: undoing hands it its part back.
"""

from __future__ import annotations

from regraft.adaptation_manager.steps.actions import PlannedStep, ReachState
from regraft.adaptation_manager.steps.draft import Draft
from regraft.bus_schema.model.adaptation import Remove
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.suggestions import instead_of


def plan(draft: Draft, change: Remove) -> None:
    """Add the change to the draft. Needs that are no longer met show in the resulting architecture."""
    name = change.component
    spec = draft.spec(name)
    why = spec.description.removal_forbidden if spec.description else ""
    if why or name == draft.manager:
        draft.refuse(name, "component", f"cannot be removed: {why or 'it carries out the removal'}")
        return
    if name in draft.swapped:
        draft.refuse(name, "component", "is swapped in the same request: leave that out")
        return
    if name in draft.moved:
        draft.refuse(name, "component", "is moved in the same request: leave that out")
        return
    if name in draft.added:
        draft.refuse(name, "component", "is added in the same request: leave both out")
        return
    known = draft.architecture.topics
    for topic in change.topics:
        if topic not in known:
            draft.refuse(name, f"topics.{topic}", f"there is no such topic; {instead_of(topic, known)}")
    draft.architecture = draft.architecture.without({name}).with_topics((), change.topics)
    draft.removed.add(name)
    live = draft.live.pop(name, None)
    if live is not None and live.state is State.ACTIVE:
        draft.steps.append(
            PlannedStep(
                name,
                "deactivate, to be ended",
                ReachState(name, State.INACTIVE, dict(live.connections), hold=True),
                ReachState(name, live.state, dict(live.connections)),
            )
        )
