"""The space of options: all combinations of the slots' selections that the rules allow, within bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

from regraft.adaptation_manager.planners.choices.rules.allowed_combinations import MAX_STEPS, Search, TooHard, parts_of
from regraft.adaptation_manager.planners.choices.rules.constraints import rules_of
from regraft.adaptation_manager.planners.choices.rules.infeasible import impossible
from regraft.adaptation_manager.planners.choices.rules.rules import Rule
from regraft.adaptation_manager.planners.choices.slots import Option, Slot, option_of
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage

Part = tuple[list[int], list[tuple[int, ...]]]


def options_of(slots: Sequence[Slot], constraints: Sequence[PlainValue], most: int = 10_000) -> tuple[Option, ...]:
    """Return the options that constraints allow, in the order of the slots and of their alternatives.

    Raises:
        BadMessage: a constraint is malformed; the constraints leave none, or more than ``most``; or they are too
            tangled to find out within ``MAX_STEPS`` steps.
    """
    try:
        rules = rules_of(constraints, slots)
    except BadMessage as error:
        raise error.inside("constraints") from None
    texts = [f"constraint {index}, {_shown(constraint)}" for index, constraint in enumerate(constraints)]
    return allowed_options(slots, rules, texts, most)


def allowed_options(
    slots: Sequence[Slot], rules: Sequence[Rule], texts: Sequence[str], most: int
) -> tuple[Option, ...]:
    """Return the options that rules allow; ``texts`` describe the sources of the rules. Raises BadMessage."""
    sizes = [len(slot.selections) for slot in slots]
    try:
        parts = [_part(sizes, members, tied, texts, most) for members, tied in parts_of(sizes, rules)]
    except TooHard:
        raise BadMessage(
            f"no end was found in {MAX_STEPS} steps: give fewer values, or constraints that settle more",
            ("constraints",),
        ) from None
    count = math.prod(len(found) for _, found in parts)
    if count > most:
        raise _too_many(f"{count}", most)
    return tuple(option_of(slots, chosen) for chosen in sorted(_joined(parts, len(sizes))))


def _part(sizes: Sequence[int], members: list[int], tied: list[Rule], texts: Sequence[str], most: int) -> Part:
    found = Search(sizes, members, tied).solutions(most + 1)
    if not found:
        raise BadMessage(impossible(sizes, members, tied, texts), ("constraints",))
    if len(found) > most:
        raise _too_many(f"more than {most}", most)
    return members, found


def _joined(parts: Sequence[Part], slots: int) -> list[tuple[int, ...]]:
    """Return the combinations of all slots: each part's with each other part's."""
    joined = []
    for chosen in product(*(found for _, found in parts)):
        selections = [0] * slots
        for (members, _), picked in zip(parts, chosen, strict=True):
            for slot, selection in zip(members, picked, strict=True):
                selections[slot] = selection
        joined.append(tuple(selections))
    return joined


def _too_many(count: str, most: int) -> BadMessage:
    what = f"there are {count} options, must be at most {most}: give fewer values, or constraints that leave fewer"
    return BadMessage(what, ("options",))


def _shown(constraint: PlainValue) -> str:
    because = f", because {constraint['because']}" if "because" in constraint else ""
    text = str({key: value for key, value in constraint.items() if key != "because"})
    return (text if len(text) <= 200 else f"{text[:197]}...") + because
