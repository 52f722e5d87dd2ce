"""Checks a stack's own constraints."""

from __future__ import annotations

from collections.abc import Iterator

from bus_schema.adaptation import Violation
from bus_schema.architecture import Architecture, Constraint, ConstraintKind
from bus_schema.description import ParameterDescription
from bus_schema.lifecycle import State
from bus_schema.parameter_values import effective_parameter, parameter_problem
from bus_schema.suggestions import instead_of


def constraint_violations(architecture: Architecture) -> Iterator[Violation]:
    """Yield the constraints of ``architecture`` that are not kept.

    A component that does not exist (any more) is not active, and its parameters need not be anything.
    """
    for index, constraint in enumerate(architecture.constraints):
        if constraint.kind is ConstraintKind.PARAMETER:
            found = _parameter_violation(architecture, constraint)
        else:
            found = _activity_violation(architecture, constraint, f"constraints.{index}")
        if found:
            yield found


def split_parameter(path: str) -> tuple[str, str]:
    """Return component and parameter of ``component.parameter``; the component's name may itself hold a dot.

    >>> split_parameter("rescuer.navigator.max_velocity")
    ('rescuer.navigator', 'max_velocity')
    """
    component, _, parameter = path.rpartition(".")
    return component, parameter


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


def _kind_is_wrong(parameter: ParameterDescription, value: object) -> bool:
    return not isinstance(value, int | float) and parameter_problem(parameter, value) is not None


def _outside(value: object, constraint: Constraint) -> str:
    """Say what ``value`` must be, nothing if it is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "must be a number"
    if constraint.minimum is not None and value < constraint.minimum:
        return f"must be at least {constraint.minimum}"
    if constraint.maximum is not None and value > constraint.maximum:
        return f"must be at most {constraint.maximum}"
    return ""


def _because(constraint: Constraint) -> str:
    return f", because {constraint.because}" if constraint.because else ""
