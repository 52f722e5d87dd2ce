"""Rules as data: atoms, built-ins, and implications from a body to a head.

The meaning is that of SWRL (W3C member submission, 21 May 2004), under the assumption of unique names: two
individuals are the same if and only if their IRIs are equal.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import Argument, Var, local_name, text_of


@dataclass(frozen=True, slots=True)
class Atom:
    """A class with one argument, or a property with two."""

    predicate: str
    arguments: tuple[Argument, ...]


@dataclass(frozen=True, slots=True)
class Builtin:
    """A comparison or an arithmetic relation; ``name`` is SWRL's, without its namespace."""

    name: str
    arguments: tuple[Argument, ...]


@dataclass(frozen=True, slots=True)
class Identity:
    """Two arguments are the same individual, or are different ones."""

    same: bool
    arguments: tuple[Argument, ...]


BodyAtom: TypeAlias = Atom | Builtin | Identity


@dataclass(frozen=True, slots=True)
class Rule:
    """Where all of the body holds, all of the head holds; ``file`` is the file that states it."""

    name: str
    body: tuple[BodyAtom, ...]
    head: tuple[Atom, ...]
    file: str = field(default="", compare=False)
    comment: str = field(default="", compare=False)


class RuleError(ValueError):
    """A rule that has no meaning; names its file, the rule, and the variable at fault where there is one."""

    def __init__(self, why: str, rule: str, file: str = "", variable: str = "") -> None:
        self.why = why
        self.rule = rule
        self.file = file
        self.variable = variable
        super().__init__(f"{f'{file}: ' if file else ''}rule {rule!r}: {why}")


def atom_text(atom: BodyAtom) -> str:
    """Return an atom as people read it."""
    inside = ", ".join(text_of(argument) for argument in atom.arguments)
    match atom:
        case Atom(predicate):
            return f"{local_name(predicate)}({inside})"
        case Builtin(name):
            return f"{name}({inside})"
        case Identity(same):
            return f"{'sameAs' if same else 'differentFrom'}({inside})"


def rule_text(rule: Rule) -> str:
    """Return a rule as people read it.

    >>> rule_text(Rule("S", (Atom("x#a", (Var("v"),)),), (Atom("x#b", (Var("v"),)),)))
    'a(?v) -> b(?v)'
    """
    body, head = (", ".join(atom_text(atom) for atom in atoms) for atoms in (rule.body, rule.head))
    return f"{body} -> {head}"


def variables(atom: BodyAtom) -> Iterator[Var]:
    """Yield the variables of an atom, as often as they occur."""
    return (argument for argument in atom.arguments if isinstance(argument, Var))
