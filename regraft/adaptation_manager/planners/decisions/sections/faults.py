"""The section ``faults``: conditions under which alternatives are excluded, or some are prescribed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.adaptation_manager.planners.decisions.fields import expression
from regraft.adaptation_manager.planners.decisions.model import Fault
from regraft.adaptation_manager.planners.decisions.sections.choices import Choices
from regraft.bus_schema.suggestions import no_such
from regraft.stack.yaml.nodes import plain
from regraft.stack.yaml.section import Section

CONSEQUENCES: Final = ("excludes", "prescribes")


def read_faults(document: Section, choices: Choices) -> tuple[Fault, ...]:
    """Return the faults."""
    table = document.section("faults")
    found = []
    for name in table.names():
        section = table.section(name)
        section.only("when", "excludes", "prescribes")
        if "when" not in section:
            section.wrong("when", "is missing: the condition under which this is so")
        given = [node for key in CONSEQUENCES if (node := section.node(key)) is not None]
        if all(node.value is None or node.value == {} for node in given):
            table.wrong(name, "has no consequence: give 'excludes' or 'prescribes'")
        when = expression(section, "when")
        excludes = tuple(_alternatives(section.section("excludes"), choices))
        prescribes = tuple(_alternatives(section.section("prescribes"), choices))
        _check_left(section, choices.slots, dict(excludes), dict(prescribes))
        if when is not None:
            found.append(Fault(name, when, excludes, prescribes))
    return tuple(found)


def _alternatives(section: Section, choices: Choices) -> Iterator[tuple[int, int]]:
    """Yield the index of each slot that is named, and the mask of its alternatives that are."""
    index_of = {slot.name: index for index, slot in enumerate(choices.slots)}
    for name in section.names():
        node = section.node(name)
        if name in choices.wrong:
            continue  # the choice itself is noted
        if name not in index_of or node is None:
            section.wrong(name, no_such("choice", name, index_of))
            continue
        slot = choices.slots[index_of[name]]
        given = plain(node)
        mask = 0
        for value in given if isinstance(given, list) else [given]:
            index = slot.index_of(value)
            if index is None:
                known = [str(each.name) for each in slot.alternatives]
                section.wrong(name, no_such("alternative", str(value), known))
            else:
                mask |= 1 << index
        if given == []:
            section.wrong(name, "is an empty list: name at least one alternative")
        yield index_of[name], mask


def _check_left(
    section: Section, slots: Sequence[Slot], excludes: Mapping[int, int], prescribes: Mapping[int, int]
) -> None:
    """Note choices for which a fault leaves nothing, or prescribes what it excludes."""
    for index, mask in excludes.items():
        slot = slots[index]
        if all(any(mask >> each & 1 for each in chosen) for chosen in slot.selections):
            section.wrong(f"excludes.{slot.name}", "leaves nothing to choose: leave one alternative out")
        elif mask & prescribes.get(index, 0):
            section.wrong(f"prescribes.{slot.name}", "has an alternative that the same fault excludes")
