"""The section ``constraints``: which alternatives go together, what must be true of a choice, how much there is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from regraft.adaptation_manager.planners.choices.rules.constraints import FORMS, rules_of
from regraft.adaptation_manager.planners.choices.rules.rules import Rule
from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.adaptation_manager.planners.decisions.fields import expression, items
from regraft.adaptation_manager.planners.decisions.model import AmountLimit, Requirement
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


def read_constraints(document: Section, slots: Sequence[Slot]) -> Constraints:
    """Return what the constraints come to."""
    found = Constraints()
    table = items(document, "constraints")
    for index in table.names():
        _read(table, index, slots, found)
    return found


def _read(table: Section, index: str, slots: Sequence[Slot], found: Constraints) -> None:
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
        _limit(section, index, reason, slots, found)
    else:
        _rules(table, index, reason, slots, found)


def _limit(section: Section, index: str, reason: str, slots: Sequence[Slot], found: Constraints) -> None:
    figure, most = section.text("limit"), expression(section, "at_most")
    figures = {name for slot in slots for each in slot.alternatives for name in each.figures}
    if figure not in figures:
        section.wrong("limit", no_such("figure", figure, figures))
    elif most is not None:
        text = f"constraint {index}, {figure} at most {most.text}{reason}"
        found.limits.append(AmountLimit(section.at("at_most"), text, figure, most))


def _rules(table: Section, index: str, reason: str, slots: Sequence[Slot], found: Constraints) -> None:
    node = table.node(index) or Node(None)
    given = plain(node)
    try:
        rules = rules_of([given], slots, "choice")
    except BadMessage as error:
        table.wrong(".".join((index, *error.where[1:])), error.why)
        return
    shown = {key: value for key, value in given.items() if key != "because"}
    found.rules.append((f"constraint {index}, {shown}{reason}", tuple(rules)))
