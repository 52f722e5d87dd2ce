"""The section ``faults``: conditions under which alternatives are excluded, or some are prescribed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from regraft.adaptation_manager.planners.choices.slots import Slot
from regraft.adaptation_manager.planners.decisions.fields import expression
from regraft.adaptation_manager.planners.decisions.model import Fault
from regraft.bus_schema.suggestions import no_such
from regraft.stack.yaml.nodes import plain
from regraft.stack.yaml.section import Section


def read_faults(document: Section, slots: Sequence[Slot]) -> tuple[Fault, ...]:
    """Return the faults."""
    table = document.section("faults")
    found = []
    for name in table.names():
        section = table.section(name)
        section.only("when", "excludes", "prescribes")
        if "when" not in section:
            section.wrong("when", "is missing: the condition under which this is so")
        if "excludes" not in section and "prescribes" not in section:
            table.wrong(name, "has no consequence: give 'excludes' or 'prescribes'")
        when = expression(section, "when")
        excludes = tuple(_alternatives(section.section("excludes"), slots))
        prescribes = tuple(_alternatives(section.section("prescribes"), slots))
        if when is not None:
            found.append(Fault(name, when, excludes, prescribes))
    return tuple(found)


def _alternatives(section: Section, slots: Sequence[Slot]) -> Iterator[tuple[int, int]]:
    """Yield the index of each slot that is named, and the mask of its alternatives that are."""
    index_of = {slot.name: index for index, slot in enumerate(slots)}
    for name in section.names():
        node = section.node(name)
        if name not in index_of or node is None:
            section.wrong(name, no_such("choice", name, index_of))
            continue
        slot = slots[index_of[name]]
        given = plain(node)
        mask = 0
        for value in given if isinstance(given, list) else [given]:
            index = slot.index_of(value)
            if index is None:
                known = [str(each.name) for each in slot.alternatives]
                section.wrong(name, no_such("alternative", str(value), known))
            else:
                mask |= 1 << index
        yield index_of[name], mask
