"""Completes the spec of a component that does not run yet by its class."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field, replace
from pathlib import Path

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.messages.protocol.host import DescribedComponent
from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.lockstep.source import TimeSource
from regraft.process.main import NoSuchClass, load_class
from regraft.stack.assembly.references import replaced
from regraft.stack.classes import describe_class, taken_values
from regraft.stack.files import file_problems
from regraft.stack.relative_paths import with_absolute_paths
from regraft.stack.sections.components import in_run_folder


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The meaning of parameters on this host.

    A relative path is looked for from ``stack_folder``, and ``$RUN`` is ``folder``. ``references`` has the values of
    further names such as ``$robots``, by robot; the empty name is the stack itself.
    """

    stack_folder: Path
    folder: str
    references: dict[str, dict[str, PlainValue]] = field(default_factory=dict)

    def completed(self, spec: ComponentSpec) -> dict[str, PlainValue]:
        """Return parameters without references, and with those that the class takes from its robot."""
        own = self.references.get(spec.name.rpartition(".")[0], {})
        known = own or self.references.get("", {})
        taken = taken_values(spec.name, spec.cls, self.references)
        return taken | {name: replaced(value, known) for name, value in spec.parameters.items()}


def describe_component(spec: ComponentSpec, surroundings: Surroundings) -> DescribedComponent:
    """Return a spec completed by its class, as a component of a stack file is, and its problems."""
    folder = surroundings.folder
    if not spec.cls:
        return DescribedComponent(in_run_folder(spec, folder), tuple(_program_problems(spec)))
    spec = replace(spec, parameters=surroundings.completed(spec))
    try:
        description, problems = describe_class(spec.cls, spec.parameters)
    except NoSuchClass as error:
        return DescribedComponent(spec, (Violation(None, spec.name, "class", str(error)),))
    found = [Violation(None, spec.name, f"parameters.{place}", why) for place, why in problems]
    if issubclass(load_class(spec.cls), TimeSource):
        problem = f"{spec.cls!r} is a source of time: a system has one, from its start"
        found.append(Violation(None, spec.name, "class", problem))
    completed = replace(
        spec,
        description=description,
        parameters=with_absolute_paths(description, dict(spec.parameters), surroundings.stack_folder),
        services={offered.name: offered.name for offered in description.services} | spec.services,
    )
    found += [
        Violation(None, spec.name, f"parameters.{name}", problem)
        for name, problem in file_problems(description, completed.parameters)
    ]
    return DescribedComponent(in_run_folder(completed, folder), tuple(found))


def _program_problems(spec: ComponentSpec) -> list[Violation]:
    if not spec.command or shutil.which(spec.command[0]):
        return []
    problem = f"there is no program {spec.command[0]!r} that can be run"
    return [Violation(None, spec.name, "command", problem)]
