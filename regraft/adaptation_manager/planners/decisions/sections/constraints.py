"""The section ``constraints``: which alternatives go together, what must be true of a choice, how much there is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from regraft.adaptation_manager.planners.choices.rules.constraints import FORMS, rules_of
from regraft.adaptation_manager.planners.choices.rules.rules import Clause, Rule
from regraft.adaptation_manager.planners.decisions.fields import expression, items
from regraft.adaptation_manager.planners.decisions.model import AmountLimit, Requirement
from regraft.adaptation_manager.planners.decisions.sections.choices import Choices
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.suggestions import no_such
from regraft.stack.yaml.nodes import Node, plain
from regraft.stack.yaml.section import Section

ALL_FORMS: Final = (*FORMS, {"require"}, {"limit", "at_most"})


@dataclass(slots=True)
class Constraints:
    """The rules, requirements and limits of a decision."""

    rules: list[tuple[str, tuple[Rule, ...]]] = field(default_factory=list)
    requirements: list[Requirement] = field(default_factory=list)
    limits: list[AmountLimit] = field(default_factory=list)


def read_constraints(document: Section, choices: Choices) -> Constraints:
    """Return what the constraints come to."""
    found = Constraints()
    table = items(document, "constraints")
    for index in table.names():
        _read(table, index, choices, found)
    return found


def _read(table: Section, index: str, choices: Choices, found: Constraints) -> None:
    section = table.section(index)
    if set(section.names()) - {"because"} not in ALL_FORMS:
        forms = "'forbid'; 'if' and 'then'; 'compare'; 'require'; or 'limit' and 'at_most' (and may have 'because')"
        table.wrong(index, f"must have {forms}; has {', '.join(section.names()) or 'nothing'}")
        return
    because = section.text("because")
    reason = f", because {because}" if because else ""
    if "require" in section:
        required = expression(section, "require")
        if required is not None:
            text = f"constraint {index}, {required.text}{reason}"
            found.requirements.append(Requirement(section.at("require"), text, required))
    elif "limit" in section:
        _limit(section, index, reason, choices, found)
    else:
        _rules(table, index, reason, choices, found)


def _limit(section: Section, index: str, reason: str, choices: Choices, found: Constraints) -> None:
    figure, most = section.text("limit"), expression(section, "at_most")
    figures = {name for slot in choices.slots for each in slot.alternatives for name in each.figures}
    if figure not in figures:
        if choices.right:
            section.wrong("limit", no_such("figure", figure, figures))
    elif most is not None:
        text = f"constraint {index}, {figure} at most {most.text}{reason}"
        found.limits.append(AmountLimit(section.at("at_most"), text, figure, most))


def _rules(table: Section, index: str, reason: str, choices: Choices, found: Constraints) -> None:
    node = table.node(index) or Node(None)
    given = plain(node)
    if not choices.wrong.isdisjoint(_named(given)):
        return  # the choice itself is noted
    try:
        rules = rules_of([given], choices.slots, "choice")
    except BadMessage as error:
        table.wrong(".".join((index, *error.where[1:])), error.why)
        return
    if any(isinstance(rule, Clause) and not any(mask for _, mask in rule.ways) for rule in rules):
        table.wrong(index, "can never be kept: it leaves nothing to choose")
        return
    shown = {key: value for key, value in given.items() if key != "because"}
    found.rules.append((f"constraint {index}, {shown}{reason}", tuple(rules)))


def _named(constraint: dict[str, PlainValue]) -> Iterator[str]:
    """Yield the names of choices that a rule speaks of."""
    for part in constraint.values():
        yield from (each for each in part if isinstance(each, str)) if isinstance(part, dict | list) else ()
