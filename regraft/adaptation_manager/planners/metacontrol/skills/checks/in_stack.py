"""Skills compared with a stack: its components, their parameters and the bounds of these."""

from __future__ import annotations

from pathlib import Path

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Code, Findings
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import every_component
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Configuration, SkillSet
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import Architecture, ComponentSpec
from regraft.bus_schema.model.robots.scopes import component_in_scope
from regraft.bus_schema.suggestions import Hints
from regraft.stack.relative_paths import with_absolute_paths
from regraft.stack.sections.mode_changes import parameter_problems


def component_in_stack(name: str) -> str:
    """Return the component that a name means: ``robot/drive`` is ``robot.drive``."""
    return name.replace("/", ".")


def check_in(skills: SkillSet, architecture: Architecture, scope: str, findings: Findings) -> None:
    """Note components that the stack has not or does not manage, and values that their classes refuse.

    ``scope`` is the robot whose skills they are, empty for the system's.
    """
    hints = Hints(architecture.components)
    judged: set[str] = set()
    seen: set[tuple[str, str, str]] = set()
    for component in every_component(skills):
        name = component_in_scope(scope, component_in_stack(component.name))
        spec = architecture.components.get(name)
        if name not in judged and spec is None:
            problem = f"there is no component {name!r}; {hints.instead_of(name)}"
            findings.error(component.place, Code.UNKNOWN_COMPONENT, problem)
        elif name not in judged and spec is not None and not spec.managed:
            problem = f"{name!r} is unmanaged: it does not speak the lifecycle, so no realization can use it"
            findings.error(component.place, Code.UNMANAGED_COMPONENT, problem)
        judged.add(name)
        for each in component.configurations if spec is not None and spec.managed else ():
            assert spec is not None
            _check_parameters(each, spec, seen, findings)


def _check_parameters(
    configuration: Configuration, spec: ComponentSpec, seen: set[tuple[str, str, str]], findings: Findings
) -> None:
    """Note what the component's class refuses, once for each configuration; classes of other hosts are not known."""
    if spec.description is None or not configuration.is_active:
        return
    places = {each.name: each.place for each in configuration.parameters or () if each.value is not None}
    given: dict[str, PlainValue] = {
        each.name: each.value for each in configuration.parameters or () if each.value is not None
    }
    folder = Path(configuration.place.file).parent
    values = with_absolute_paths(spec.description, given, folder)
    for field, problem in parameter_problems(spec, [spec.description], values):
        name = field if field in places else next((each for each in places if field.startswith(f"{each}.")), field)
        if (spec.name, configuration.name, field) in seen or name not in places:
            continue
        seen.add((spec.name, configuration.name, field))
        unknown = spec.description.parameter(name) is None
        code = Code.UNKNOWN_PARAMETER if unknown else Code.UNFIT_VALUE
        findings.error(places[name], code, f"{spec.name}.{field}: {problem}")
