"""Checks that a rule has a meaning: known built-ins, and variables that the body binds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.atoms import (
    Atom,
    Builtin,
    Identity,
    Rule,
    RuleError,
    atom_text,
    variables,
)
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.builtins import ARITHMETIC, NAMES, arity_problem
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Var, local_name
from regraft.bus_schema.suggestions import no_such

MAX_ATOMS: Final = 100
"""Atoms of one rule; those that are published have 14 at most."""


def check_rule(rule: Rule) -> None:
    """Raise RuleError unless a rule has a meaning and its head follows for finitely many individuals."""
    if not rule.head:
        raise _error(rule, "the head is empty, must have at least one atom")
    if len(rule.body) + len(rule.head) > MAX_ATOMS:
        raise _error(rule, f"it has {len(rule.body) + len(rule.head)} atoms, must have at most {MAX_ATOMS}")
    for atom in (*rule.body, *rule.head):
        _check_arity(rule, atom)
    bound = bound_variables(rule)
    for atom in rule.body:
        for variable in variables(atom):
            if variable not in bound:
                raise _unsafe(rule, variable, f"in {atom_text(atom)}")
    for atom in rule.head:
        for variable in variables(atom):
            if variable not in bound:
                raise _unsafe(rule, variable, f"in the head, in {atom_text(atom)}")


def bound_variables(rule: Rule) -> set[Var]:
    """Return the variables that the classes, properties and arithmetic of the body bind."""
    bound = {variable for atom in rule.body if isinstance(atom, Atom) for variable in variables(atom)}
    waiting = [atom for atom in rule.body if isinstance(atom, Builtin) and atom.name in ARITHMETIC]
    while ready := [atom for atom in waiting if _inputs(atom) <= bound]:
        bound.update(variable for atom in ready for variable in variables(atom))
        waiting = [atom for atom in waiting if atom not in ready]
    return bound


def _inputs(atom: Builtin) -> set[Var]:
    """Return the variables that an arithmetic built-in reads: the first argument is its result."""
    return {argument for argument in atom.arguments[1:] if isinstance(argument, Var)}


def _check_arity(rule: Rule, atom: Atom | Builtin | Identity) -> None:
    count = len(atom.arguments)
    match atom:
        case Builtin(name):
            if name not in NAMES:
                raise _error(rule, no_such("built-in", name, NAMES))
            if problem := arity_problem(name, count):
                raise _error(rule, problem)
        case Atom():
            if count not in {1, 2}:
                raise _error(rule, f"{atom_text(atom)} has {count} arguments, must have 1 (class) or 2 (property)")
        case Identity():
            if count != 2:
                raise _error(rule, f"{atom_text(atom)} has {count} arguments, must have 2")


def _unsafe(rule: Rule, variable: Var, where: str) -> RuleError:
    name = local_name(variable.name)
    others: Iterable[str] = (local_name(other.name) for other in bound_variables(rule))
    listed = ", ".join(f"?{other}" for other in sorted(set(others)))
    why = f"no class or property of the body binds the variable ?{name} {where}; bound are: {listed or 'none'}"
    return RuleError(why, rule.name, rule.file, name)


def _error(rule: Rule, why: str) -> RuleError:
    return RuleError(why, rule.name, rule.file)
