"""The space of options: all combinations of the dimensions' choices that the constraints allow, within bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from itertools import product

from regraft.adaptation_manager.planners.bandits.constraints import rules_of
from regraft.adaptation_manager.planners.bandits.dimensions import Dimension, Option, option_of
from regraft.adaptation_manager.planners.bandits.search import MAX_STEPS, Rule, Search, TooHard, parts_of
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.errors import BadMessage

STEPS_PER_SUSPECT = 5_000
MAX_NAMED = 8

Part = tuple[list[int], list[tuple[int, ...]]]


def options_of(
    dimensions: Sequence[Dimension], constraints: Sequence[PlainValue], most: int = 10_000
) -> tuple[Option, ...]:
    """Return the options, in the order of the dimensions and of their choices.

    Raises:
        BadMessage: a constraint is malformed; the constraints leave none, or more than ``most``; or they are too
            tangled to find out within ``MAX_STEPS`` steps.
    """
    try:
        rules = rules_of(constraints, dimensions)
    except BadMessage as error:
        raise error.inside("constraints") from None
    sizes = [len(dimension.choices) for dimension in dimensions]
    try:
        parts = [_part(sizes, members, tied, constraints, most) for members, tied in parts_of(sizes, rules)]
    except TooHard:
        raise BadMessage(
            f"no end was found in {MAX_STEPS} steps: give fewer values, or constraints that settle more",
            ("constraints",),
        ) from None
    count = math.prod(len(found) for _, found in parts)
    if count > most:
        raise _too_many(f"{count}", most)
    return tuple(
        option_of(dimensions, [d.choices[index] for d, index in zip(dimensions, indices, strict=True)])
        for indices in sorted(_joined(parts, len(sizes)))
    )


def _part(
    sizes: Sequence[int], members: list[int], tied: list[Rule], constraints: Sequence[PlainValue], most: int
) -> Part:
    found = Search(sizes, members, tied).solutions(most + 1)
    if not found:
        raise _impossible(sizes, members, tied, constraints)
    if len(found) > most:
        raise _too_many(f"more than {most}", most)
    return members, found


def _joined(parts: Sequence[Part], dimensions: int) -> list[tuple[int, ...]]:
    """Return the combinations of all dimensions: each part's with each other part's."""
    joined = []
    for chosen in product(*(found for _, found in parts)):
        indices = [0] * dimensions
        for (members, _), choices in zip(parts, chosen, strict=True):
            for dimension, choice in zip(members, choices, strict=True):
                indices[dimension] = choice
        joined.append(tuple(indices))
    return joined


def _too_many(count: str, most: int) -> BadMessage:
    what = f"there are {count} options, must be at most {most}: give fewer values, or constraints that leave fewer"
    return BadMessage(what, ("options",))


def _impossible(
    sizes: Sequence[int], members: list[int], tied: Sequence[Rule], constraints: Sequence[PlainValue]
) -> BadMessage:
    """Say which constraints leave no option: a smallest set, without any of which there would be some.

    Where it is hard to tell, a constraint counts as one of them.
    """
    guilty = list(tied)
    for source in sorted({rule.source for rule in tied}, reverse=True):
        others = [rule for rule in guilty if rule.source != source]
        with suppress(TooHard):
            if not Search(sizes, members, others, STEPS_PER_SUSPECT).solutions(1):
                guilty = others
    sources = sorted({rule.source for rule in guilty})
    named = " and ".join(f"constraint {source}, {_shown(constraints[source])}," for source in sources[:MAX_NAMED])
    if len(sources) > MAX_NAMED:
        named += f" and {len(sources) - MAX_NAMED} more"
    verb = "leaves" if len(sources) == 1 else "together leave"
    return BadMessage(
        f"{named} {verb} no option: change {'it' if len(sources) == 1 else 'one of them'}", ("constraints",)
    )


def _shown(constraint: PlainValue) -> str:
    because = f", because {constraint['because']}" if "because" in constraint else ""
    text = str({key: value for key, value in constraint.items() if key != "because"})
    return (text if len(text) <= 200 else f"{text[:197]}...") + because
