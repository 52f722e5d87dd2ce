"""``set_parameters``: the values of the spec change, and those of the running component, all or none."""

from __future__ import annotations

from dataclasses import replace

from regraft.adaptation_manager.steps.actions import ApplyParameters, PlannedStep
from regraft.adaptation_manager.steps.draft import Draft
from regraft.bus_schema.model.adaptation import SetParameters


def plan(draft: Draft, change: SetParameters) -> None:
    """Add the change to the draft. Types, names and bounds are judged on the resulting architecture."""
    spec = draft.spec(change.component)
    if not change.parameters:
        draft.refuse(change.component, "parameters", "names no parameter: must name at least one")
    live = draft.live.get(change.component)
    for name in sorted(change.parameters):
        described = spec.description.parameter(name) if spec.description else None
        if described and described.read_only and live and live.parameters.get(name) != change.parameters[name]:
            draft.refuse(change.component, f"parameters.{name}", "is read-only, set when the component starts")
    draft.update(replace(spec, parameters={**spec.parameters, **change.parameters}))
    if live is None or not change.parameters:
        return
    former = {name: live.parameters[name] for name in change.parameters if name in live.parameters}
    text = ", ".join(f"{name} = {change.parameters[name]!r}" for name in sorted(change.parameters))
    draft.steps.append(
        PlannedStep(
            change.component,
            f"set {text}",
            ApplyParameters(change.component, dict(change.parameters)),
            ApplyParameters(change.component, former),
        )
    )
    draft.live[change.component] = replace(live, parameters={**live.parameters, **change.parameters})
