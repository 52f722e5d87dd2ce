"""Checks the changes of modes by the classes that their components have, or get from modes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.adaptation import Add, Change, ChangeState, Connect, Move, Remove, SetParameters, Swap
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec, TopicSpec
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.parameter_values import effective_parameter, parameter_problem
from regraft.bus_schema.model.wiring import connection_problem
from regraft.bus_schema.suggestions import Hints, instead_of
from regraft.process.main import NoSuchClass
from regraft.stack.classes import describe_class, device_classes, taken_values
from regraft.stack.files import file_problems
from regraft.stack.sections.hosts import FIRST

OF_COMPONENTS = (SetParameters, Connect, ChangeState, Swap)
"""Changes that need a component which speaks the lifecycle."""
Found = Iterator[tuple[str, str]]
"""Fields, by their dotted paths, and what is wrong with them."""


@dataclass(frozen=True, slots=True)
class Surroundings:
    """A stack around its modes: ``references`` have the values of its robots, by robot.

    No module that is ``refused`` is imported. Why it is refused is noted already.
    """

    refused: Collection[str]
    references: Mapping[str, Mapping[str, PlainValue]]


@dataclass(frozen=True, slots=True)
class ModeTargets:
    """The components that modes change, and the topics that they may use then.

    ``classes`` has the descriptions of the classes that modes give to a component, by its name. One that is not known
    is None: it may be on another host, or is wrong, and reported as such.
    """

    architecture: Architecture
    topics: Mapping[str, TopicSpec]
    classes: Mapping[str, list[Description | None]]
    around: Surroundings

    def descriptions(self, component: str) -> list[Description] | None:
        """Return a component's descriptions, as it is in the stack first; None if one is not known."""
        spec = self.architecture.components.get(component)
        every = [*([spec.description] if spec else []), *self.classes.get(component, [])]
        known = [each for each in every if each is not None]
        return known if len(known) == len(every) else None


def targets_of(architecture: Architecture, changes: Iterable[Change], around: Surroundings) -> ModeTargets:
    """Return what all changes of all modes are about."""
    topics = dict(architecture.topics)
    classes: dict[str, list[Description | None]] = {}
    for change in changes:
        spec = architecture.components.get(change.component)
        if isinstance(change, Add):
            topics |= {topic.name: topic for topic in change.topics}
        if isinstance(change, Add | Swap):
            described = _described(change, spec, around)
            classes.setdefault(change.component, []).append(described.description)
    return ModeTargets(architecture, topics, classes, around)


def description_for(
    change: Change, spec: ComponentSpec | None, around: Surroundings, folders: Mapping[str, Path]
) -> Description | None:
    """Return the description by which a change's parameters are read; None if it is not known here.

    ``folders`` are those from which the change's relative paths are looked for.
    """
    if isinstance(change, Add | Swap):
        return _described(change, spec, around, folders).description
    return spec.description if spec else None


def change_problems(change: Change, targets: ModeTargets) -> Found:
    """Yield the fields of a change that can never be as they are, whichever modes were entered before."""
    spec = targets.architecture.components.get(change.component)
    descriptions = targets.descriptions(change.component)
    yield from _unknown_names(change, targets)
    if spec is not None and not spec.managed and isinstance(change, OF_COMPONENTS):
        yield "component", unmanaged(change.component)
    elif isinstance(change, Add | Swap):
        yield from _class_problems(change, spec, targets)
    elif spec is None:
        return  # it is added, or reported as missing
    elif descriptions is not None and isinstance(change, SetParameters):
        if not change.parameters:
            yield "parameters", "names no parameter: must name at least one"
        for name, problem in parameter_problems(spec, descriptions, change.parameters):
            yield f"parameters.{name}", problem
    elif descriptions is not None and len(descriptions) == 1 and isinstance(change, Connect):
        wrong = _connection_problems(descriptions[0], {change.port: change.topic}, targets.topics)
        yield from ((part, problem) for _, part, problem in wrong)


def _unknown_names(change: Change, targets: ModeTargets) -> Found:
    """Yield the hosts and topics of a change that there are not.

    Hosts are known only where the stack names some: others may join.
    """
    hosts = targets.architecture.hosts
    named = {"host": change.host} if isinstance(change, Move) else {}
    named |= {"spec.host": change.spec.host} if isinstance(change, Add) else {}
    for field, host in named.items():
        if len(hosts) > 1 and host not in hosts:
            yield field, Hints(hosts).no_such("host", host)
    if isinstance(change, Remove):
        unknown = [(index, name) for index, name in enumerate(change.topics) if name not in targets.topics]
        hints = Hints(targets.topics)
        yield from ((f"topics.{index}", hints.no_such("topic", name)) for index, name in unknown)


def unmanaged(component: str) -> str:
    """Return why no mode can change a component that does not speak the lifecycle."""
    return f"{component} is unmanaged: it does not speak the lifecycle"


def parameter_problems(spec: ComponentSpec, descriptions: list[Description], values: Mapping[str, PlainValue]) -> Found:
    """Yield the parameters of a component that no class of it takes, and what is wrong with them."""
    yield from _value_problems(descriptions, values)
    if len(descriptions) > 1:
        return
    for parameter in descriptions[0].parameters:
        present = effective_parameter(descriptions[0], spec.parameters, parameter.name)
        if parameter.read_only and parameter.name in values and values[parameter.name] != present:
            yield parameter.name, f"is read-only, set when the component starts: must be {present!r}, as it is"
    if spec.host == FIRST:
        yield from file_problems(descriptions[0], values)


def _value_problems(descriptions: list[Description], values: Mapping[str, PlainValue]) -> Found:
    known = Hints(parameter.name for each in descriptions for parameter in each.parameters)
    for name, value in values.items():
        described = [parameter for each in descriptions if (parameter := each.parameter(name)) is not None]
        problems = [parameter_problem(parameter, value) for parameter in described]
        if not described:
            yield name, f"there is no such parameter; {known.instead_of(name)}"
        elif all(problems):
            yield name, problems[0] or ""


def _connection_problems(
    description: Description, given: Mapping[str, str | None], topics: Mapping[str, TopicSpec], *, exact: bool = True
) -> Iterator[tuple[str, str, str]]:
    """Yield each port that cannot be connected as given, whether it or its topic is wrong, and why.

    Parameters may ask for more ports than an ``exact`` description has.
    """
    known = {port.name: port for port in description.ports}
    for name, topic in given.items():
        if name not in known:
            if exact:
                yield name, "port", f"there is no port {name!r}; {instead_of(name, known)}"
        elif topic is not None:
            problem = connection_problem(topics, known[name], topic)
            yield from [(name, "topic", problem)] if problem else []


def _class_problems(change: Add | Swap, spec: ComponentSpec | None, targets: ModeTargets) -> Found:
    new = change.spec if isinstance(change, Add) else change
    above = "spec." if isinstance(change, Add) else ""
    described = _described(change, spec, targets.around)
    if described.no_such_class:
        yield f"{above}class", described.no_such_class
    # A swap that names no class keeps any that a mode may have put there before.
    before = targets.descriptions(change.component) if not new.cls and isinstance(change, Swap) else []
    if described.description is None or before is None:
        return
    own = [(place, why) for place, why in described.problems if place.partition(".")[0] in new.parameters]
    descriptions = [described.description, *before]
    for name, problem in own or _value_problems(descriptions, new.parameters):
        yield f"{above}parameters.{name}", problem
    if all(each is descriptions[0] for each in descriptions):
        exact = not any(parameter.read_only for parameter in descriptions[0].parameters)
        wrong = _connection_problems(descriptions[0], new.connections, targets.topics, exact=exact)
        yield from ((f"{above}connect.{port}", problem) for port, _, problem in wrong)


@dataclass(frozen=True, slots=True)
class _Described:
    """The description of a class with the parameters that a change gives it, and what is wrong with these.

    It is None for a program, where another host has the class, and if there is ``no_such_class``.
    """

    description: Description | None = None
    problems: tuple[tuple[str, str], ...] = ()
    no_such_class: str = ""


def _described(
    change: Add | Swap,
    spec: ComponentSpec | None,
    around: Surroundings,
    folders: Mapping[str, Path] | None = None,
) -> _Described:
    """Return a class as the component's host will describe it when the change is carried out."""
    old = spec or ComponentSpec(change.component, host="")
    if isinstance(change, Add):
        cls, host, given = change.spec.cls, change.spec.host, change.spec.parameters
    else:
        cls, host, given = change.cls or old.cls, old.host, old.parameters | change.parameters
    if isinstance(change, Swap) and not change.cls and (host != FIRST or not _fixes(change, old.description)):
        return _Described(old.description)
    if not cls or host != FIRST or cls.partition(":")[0] in around.refused:
        return _Described()
    values = taken_values(change.component, cls, around.references) | given
    if any(of_device.partition(":")[0] in around.refused for _, of_device in device_classes(values)):
        return _Described()
    try:
        return _Described(*describe_class(cls, values, folders))
    except NoSuchClass as error:
        return _Described(no_such_class=str(error))


def _fixes(change: Swap, description: Description | None) -> bool:
    """Return whether a change gives parameters that decide on the others, and on ports."""
    known = description.parameters if description else ()
    return any(parameter.read_only and parameter.name in change.parameters for parameter in known)
