"""Checks a stack's own constraints."""

from __future__ import annotations

from collections.abc import Iterator

from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.model.adaptation import Violation
from regraft.bus_schema.model.architecture import Architecture, Constraint, ConstraintKind
from regraft.bus_schema.model.description import ParameterDescription
from regraft.bus_schema.model.expressions import Expression, NotComputable, Unknown
from regraft.bus_schema.model.lifecycle import State
from regraft.bus_schema.model.parameter_values import effective_parameter, parameter_problem
from regraft.bus_schema.model.robots.offered_services import offered_services
from regraft.bus_schema.suggestions import instead_of


def constraint_violations(architecture: Architecture) -> Iterator[Violation]:
    """Yield the constraints of ``architecture`` that are not kept.

    A component that does not exist (any more) is not active, and its parameters need not be anything.
    """
    for index, constraint in enumerate(architecture.constraints):
        where = f"constraints.{index}"
        if constraint.kind is ConstraintKind.PARAMETER:
            found = _parameter_violation(architecture, constraint)
        elif constraint.kind is ConstraintKind.REQUIRE:
            found = _expression_violation(architecture, constraint, where)
        elif constraint.kind is ConstraintKind.PROVIDED:
            yield from _missing_services(architecture, constraint, where)
            continue
        else:
            found = _activity_violation(architecture, constraint, where)
        if found:
            yield found


def split_parameter(path: str) -> tuple[str, str]:
    """Return component and parameter of ``component.parameter``; the component's name may itself hold a dot.

    >>> split_parameter("rescuer.navigator.max_velocity")
    ('rescuer.navigator', 'max_velocity')
    """
    component, _, parameter = path.rpartition(".")
    return component, parameter


def constraint_expression(text: str) -> Expression:
    """Return a constraint's expression; raises BadMessage if it is none, or has names that no constraint can have."""
    expression = Expression(text)
    bare = [name for name in expression.names if "." not in name]
    if bare:
        raise BadMessage(f"{bare[0]!r} has no place in a constraint: must be 'component.parameter'")
    if not expression.names:
        raise BadMessage(
            f"{text!r} speaks of no 'component.parameter': must be a condition, such as: navigator.max_velocity < 0.2"
        )
    return expression


def _activity_violation(architecture: Architecture, constraint: Constraint, field: str) -> Violation | None:
    specs = (architecture.components.get(name) for name in constraint.components)
    active = sorted({spec.name for spec in specs if spec and spec.state is State.ACTIVE})
    names = ", ".join(constraint.components)
    if constraint.kind is ConstraintKind.AT_LEAST_ONE_ACTIVE and not active:
        problem = f"at least one of {names} must be active, but none is"
    elif constraint.kind is ConstraintKind.AT_MOST_ONE_ACTIVE and len(active) > 1:
        problem = f"at most one of {names} may be active, but {' and '.join(active)} are"
    else:
        return None
    return Violation(None, "", field, problem + _because(constraint))


def _parameter_violation(architecture: Architecture, constraint: Constraint) -> Violation | None:
    name, parameter = split_parameter(constraint.parameter)
    spec = architecture.components.get(name)
    if spec is None or spec.description is None:
        return None
    described = spec.description.parameter(parameter)
    if described is None:
        known = [other.name for other in spec.description.parameters]
        problem = f"a constraint limits it, but there is no such parameter; {instead_of(parameter, known)}"
    else:
        value = effective_parameter(spec.description, spec.parameters, parameter)
        outside = _outside(value, constraint)
        # A value of a wrong type is a violation already, as a parameter.
        if not outside or _kind_is_wrong(described, value):
            return None
        problem = f"{value!r}: a constraint says that it {outside}"
    return Violation(None, name, f"parameters.{parameter}", problem + _because(constraint))


class _Values(dict[str, object]):
    """The values that an expression has asked for: parameters, and whether components are active, by dotted name."""

    def __init__(self, architecture: Architecture) -> None:
        super().__init__()
        self._components = architecture.components

    def __missing__(self, name: str) -> object:
        """Look a value up; raises KeyError if the component is not there, BadMessage if it has no such parameter."""
        component, what = split_parameter(name)
        spec = self._components.get(component)
        if what == "active" and (spec is None or spec.description is None or spec.description.parameter(what) is None):
            self[name] = spec is not None and spec.state is State.ACTIVE
            return self[name]
        if spec is None or spec.description is None:
            raise KeyError(name)
        if spec.description.parameter(what) is None:
            known = [parameter.name for parameter in spec.description.parameters]
            raise BadMessage(f"{component} has no parameter {what!r}; {instead_of(what, known)}")
        self[name] = effective_parameter(spec.description, spec.parameters, what)
        return self[name]


def _expression_violation(architecture: Architecture, constraint: Constraint, where: str) -> Violation | None:
    values = _Values(architecture)
    try:
        if constraint_expression(constraint.expression).value(values):
            return None
        now = ", ".join(f"{name} is {value!r}" for name, value in values.items())
        problem = f"{constraint.expression!r} must be so, but {now or 'is not'}"
    except BadMessage as error:
        problem = f"{constraint.expression!r}: {error}"
    except NotComputable as error:
        problem = str(error)
    except Unknown:
        return None
    return Violation(None, "", where, problem + _because(constraint))


def _missing_services(architecture: Architecture, constraint: Constraint, where: str) -> Iterator[Violation]:
    for service in constraint.services:
        able = [spec for spec in architecture.components.values() if service in offered_services(spec).values()]
        if not any(spec.state is State.ACTIVE for spec in able):
            what = f"activate {' or '.join(sorted(spec.name for spec in able))}" if able else "nobody has it"
            problem = f"service {service!r} must be offered by an active component, but is not: {what}"
            yield Violation(None, "", where, problem + _because(constraint))


def _kind_is_wrong(parameter: ParameterDescription, value: object) -> bool:
    return not isinstance(value, int | float) and parameter_problem(parameter, value) is not None


def _outside(value: object, constraint: Constraint) -> str:
    """Return what ``value`` must be, empty if it is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "must be a number"
    if constraint.minimum is not None and value < constraint.minimum:
        return f"must be at least {constraint.minimum}"
    if constraint.maximum is not None and value > constraint.maximum:
        return f"must be at most {constraint.maximum}"
    return ""


def _because(constraint: Constraint) -> str:
    return f", because {constraint.because}" if constraint.because else ""
