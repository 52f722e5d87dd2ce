"""Which designs are in force, for which objectives, and since when."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from regraft.adaptation_manager.planners.metacontrol.control.modes.designs import Designs
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Grounding, Model
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.reasoning.decisions import Plan
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.architecture import Architecture


@dataclass(frozen=True, slots=True)
class Grounded:
    """A design that is in force for an objective, since a time of the component's clock.

    ``asked`` is the mode that the architecture has for its part. It is not the design's where that was entered in part:
    others claim components of it.
    """

    objective: str
    design: str
    since: float
    asked: str = ""

    @property
    def name(self) -> str:
        """The name of the grounding: objectives that share a design have one each.

        No objective has the mark between both in its name, so no two groundings share a name.
        """
        return f"fg_{self.objective}#{local_name(self.design)}"


class Groundings:
    """The groundings by objective."""

    def __init__(self, given: Iterable[Grounded] = ()) -> None:
        self._all = {each.objective: each for each in given}

    @classmethod
    def restored(cls, remembered: Sequence[Mapping[str, Any]], model: Model) -> Groundings:
        """Return what an earlier run had, but for designs that are gone."""
        given = (Grounded(**each) for each in remembered)
        return cls(each for each in given if each.design in model.designs and not model.designs[each.design].is_rest)

    def remembered(self) -> list[PlainValue]:
        """Return what a further run has to know, as plain data."""
        return [asdict(each) for each in self]

    def __iter__(self) -> Iterator[Grounded]:
        """Yield all groundings."""
        return iter(list(self._all.values()))

    def of(self, objective: str) -> Grounded | None:
        """Return the grounding of an objective, None if it has none."""
        return self._all.get(objective)

    def facts(self) -> tuple[Grounding, ...]:
        """Return the groundings as the reasoner has them."""
        return tuple(Grounding(each.name, each.objective, each.design) for each in self)

    def after(
        self, plan: Plan, kept: Iterable[Grounded], now: float, designs: Designs, asked_modes: Mapping[str, str]
    ) -> Groundings:
        """Return the groundings once a plan has been carried out; a design that stays keeps its time."""
        found = {each.objective: each for each in kept}
        for decision in plan.decisions:
            if decision.design is not None:
                asked = asked_modes.get(designs.of(decision.design).part, "")
                known = self._all.get(decision.objective)
                since = known.since if known is not None and known.design == decision.design else now
                found[decision.objective] = Grounded(decision.objective, decision.design, since, asked)
        return Groundings(found.values())

    def followed(self, designs: Designs, architecture: Architecture, now: float) -> Groundings:
        """Return the groundings as the architecture has them: others may have entered modes meanwhile.

        A part whose mode is another design has that one. A part that is at rest, or in no design's mode, has none.
        """
        found = []
        for each in self:
            known = designs.of(each.design)
            mode = architecture.asked_modes.get(known.part, "")
            other = designs.of_mode(mode)
            if mode in (known.mode, each.asked):
                found.append(replace(each, asked=mode))
            elif other is not None and other.function == known.function:
                found.append(replace(each, design=other.design, since=now, asked=mode))
        return Groundings(found)
