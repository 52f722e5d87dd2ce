"""``regraft estimate --stack``: the qualities that a whole stack would give, as it is and after changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.protocol.host import DescribedComponent
from regraft.bus_schema.model.adaptation import AdaptationRequest, Change, EnterMode, Violation
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.consistency import violations
from regraft.bus_schema.model.lifecycle import State, Transition, route
from regraft.bus_schema.model.modes.modes import as_needed
from regraft.bus_schema.model.qualities.estimates import Figure, Source
from regraft.bus_schema.suggestions import instead_of, no_such
from regraft.cli.adaptation.mistakes import mistakes
from regraft.cli.outcomes import BadInput
from regraft.cli.terminal.output import complain, show_json, show_table
from regraft.cli.terminal.values import document, value_of
from regraft.cli.topology import Topology, named
from regraft.estimation.changes import CannotChange, changed
from regraft.estimation.estimation import Estimation
from regraft.process.main import NoSuchClass
from regraft.process.trial.trial_import import check_classes
from regraft.stack import Stack, load
from regraft.stack.describing import Surroundings, describe_component
from regraft.stack.installed import stack_file
from regraft.stack.relative_paths import RUN_FOLDER

CLASS, STATE = "class", "state"


@dataclass(frozen=True, slots=True)
class _Line:
    component: str
    quality: str
    unit: str
    before: Figure
    after: Figure


def estimate_stack(
    file: str, component: str, changes: Sequence[str], context: Mapping[str, PlainValue], *, as_json: bool
) -> None:
    """Show the predicted qualities of a stack, or one of its components, and those after changes; raises BadInput."""
    stack = load(stack_file(Path(file)), complain)
    before = stack.architecture
    after = _after(stack, changes)
    if component:
        named("component", component, before.components | after.components)
    now = Estimation(before.components, context)
    lines = _lines(before, after, now, now.changed(after.components), component)
    if as_json:
        show_json({"qualities": [_plain(line) for line in lines]})
        return
    if not changes:
        rows = [
            (f"{each.component}.{each.quality}", _shown(each.before, each.unit), _from(each.before)) for each in lines
        ]
        show_table(("quality", "predicted", "from"), rows, empty="no class estimates qualities")
        return
    differing = [each for each in lines if _value(each.before) != _value(each.after)]
    show_table(
        ("quality", "before", "after", "from"),
        [
            (
                f"{each.component}.{each.quality}",
                _shown(each.before, each.unit),
                _shown(each.after, each.unit),
                _from(each.after),
            )
            for each in differing
        ],
        empty="the changes alter no predicted quality",
    )


def _lines(before: Architecture, after: Architecture, now: Estimation, then: Estimation, component: str) -> list[_Line]:
    specs = before.components | after.components
    return [
        _Line(name, quality.name, quality.unit, now.figure(name, quality.name), then.figure(name, quality.name))
        for name, spec in sorted(specs.items())
        if spec.description is not None and component in ("", name)
        for quality in spec.description.qualities
        if quality.estimated
    ]


def _after(stack: Stack, texts: Sequence[str]) -> Architecture:
    before = stack.architecture
    described = partial(_described, Surroundings(stack.folder, RUN_FOLDER, stack.references))
    meant: list[Change] = []
    for text in texts:
        meant += _with_modes(_change(text, before), before, meant)
    known = Topology(dict(before.components), {}, before.topics, frozenset(before.hosts), before.modes)
    problems = [
        f"--change {texts[index] if len(meant) == len(texts) else index}: {why}"
        for index, why in mistakes(meant, known, described)
    ]
    if problems:
        raise BadInput("\n".join(problems))
    try:
        after = changed(before, meant, lambda spec: described(spec).spec)
    except CannotChange as error:
        raise BadInput(f"--change: {error}") from None
    known_before = set(violations(before))
    for violation in violations(after):
        if violation not in known_before:
            complain(f"an adaptation manager would reject this: {violation}")
    return after


def _with_modes(change: Change, architecture: Architecture, earlier: Sequence[Change]) -> tuple[Change, ...]:
    if not isinstance(change, EnterMode):
        return (change,)
    if change.mode not in architecture.modes:
        raise BadInput(f"--change: {no_such('mode', change.mode, architecture.modes)}")
    changes = codec.from_plain({"changes": architecture.modes[change.mode]}, AdaptationRequest).changes
    return as_needed(changes, architecture, earlier)


def _change(text: str, architecture: Architecture) -> Change:
    """Read a change: as in an adaptation file, or short as ``component.name=value``; raises BadInput."""
    if text.lstrip().startswith("{"):
        plain = document(text, "--change")
    else:
        plain = _short(text, architecture)
    try:
        (change,) = codec.from_plain({"changes": [plain]}, AdaptationRequest).changes
    except BadMessage as error:
        raise BadInput(f"--change {text}: {str(error).removeprefix('changes.0.')}") from None
    return change


def _short(text: str, architecture: Architecture) -> dict[str, PlainValue]:
    place, equals, given = text.partition("=")
    name, dot, member = place.strip().rpartition(".")
    if not equals or not dot:
        raise BadInput(
            f"--change {text}: must look like navigator.max_velocity=0.1, detector.image=corner_camera/image, "
            "mapper.class=module:Class, camera.state=inactive, or be a change of an adaptation file in braces"
        )
    spec = named("component", name, architecture.components)
    described, change = spec.description, {"component": name}
    if member == CLASS:
        return {"change": "swap", **change, "class": given}
    if member == STATE:
        return {"change": "transition", **change, "transition": _transition(text, spec, given).value}
    value = value_of(given, f"--change {place.strip()}")
    if described is not None and described.parameter(member):
        return {"change": "set_parameters", **change, "parameters": {member: value}}
    if described is not None and described.port(member):
        return {"change": "connect", **change, "port": member, "topic": None if value is None else str(value)}
    known: tuple[str, ...] = (CLASS, STATE)
    if described is not None:
        known = (*(p.name for p in described.parameters), *(p.name for p in described.ports), *known)
    raise BadInput(f"--change {text}: {name} has no parameter or port {member!r}; {instead_of(member, known)}")


def _transition(text: str, spec: ComponentSpec, given: str) -> Transition:
    states = {state.value: state for state in (State.UNCONFIGURED, State.INACTIVE, State.ACTIVE)}
    if given not in states:
        raise BadInput(f"--change {text}: {no_such('state', given, states)}")
    way = route(spec.state, states[given])
    if not way or len(way) > 1:
        raise BadInput(f"--change {text}: {spec.name} is {spec.state.value}: no single transition leads to {given}")
    return way[0]


def _described(surroundings: Surroundings, spec: ComponentSpec) -> DescribedComponent:
    """Return a spec completed by its class, as a host would."""
    if not spec.cls:
        return DescribedComponent(spec)
    try:
        check_classes([spec.cls], complain)
    except NoSuchClass as error:
        return DescribedComponent(spec, (Violation(None, spec.name, "class", str(error)),))
    return describe_component(spec, surroundings)


def _shown(figure: Figure, unit: str) -> str:
    if figure.value is None:
        return ""
    return f"{figure.value:.4g}" if unit in ("", "1") else f"{figure.value:.4g} {unit}"


def _value(figure: Figure) -> tuple[float | None, Source]:
    return figure.value, figure.source


def _from(figure: Figure) -> str:
    return f"{figure.source.value}: {figure.why}" if figure.why else figure.source.value


def _plain(line: _Line) -> dict[str, object]:
    return {
        "component": line.component,
        "quality": line.quality,
        "unit": line.unit,
        "before": codec.to_plain(line.before),
        "after": codec.to_plain(line.after),
    }
