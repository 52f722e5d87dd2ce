"""The knowledge base as a reasoner needs it: functions, designs, objectives, components and qualities, as plain data.

All names are IRIs, and are compared exactly. ``find`` turns a short name into one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import ComponentStatus, Direction
from regraft.adaptation_manager.planners.metacontrol.knowledge.vocabulary import DEFAULT_CONTEXT
from regraft.bus_schema.suggestions import no_such

LOWEST: Final = 0.0
HIGHEST: Final = 1.0
"""The range of a quality that names none: qualities are normalized (MROS, section III)."""
HIGHEST_WEIGHT: Final = 1e9
"""The highest weight of an objective: sums of huge ones would not be numbers any more."""


@dataclass(frozen=True, slots=True)
class Quality:
    """A type of quality. ``direction`` is None where the files do not state which values are better.

    ``curve`` has the utility of its values; None where the value itself is the utility, with the direction's sign.
    """

    name: str
    direction: Direction | None = None
    weight: float = 0.0
    lowest: float = LOWEST
    highest: float = HIGHEST
    curve: Curve | None = None

    @property
    def worst(self) -> float:
        """Return the worst value of the quality."""
        return self.highest if self.direction is Direction.LOWER else self.lowest

    def meets(self, value: float, bound: float) -> bool:
        """Return whether a value is as good as a bound or better; raises ValueError without a direction."""
        if self.direction is None:
            raise ValueError(f"the quality {local_name(self.name)!r} has no direction")
        return value <= bound if self.direction is Direction.LOWER else value >= bound

    @property
    def sign(self) -> str:
        """Return the relation of a value that meets a bound to that bound."""
        return "<=" if self.direction is Direction.LOWER else ">="


@dataclass(frozen=True, slots=True)
class Requirement:
    """A bound that a quality must keep: the lowest or the highest value, by the quality's direction."""

    quality: str
    bound: float


@dataclass(frozen=True, slots=True)
class Objective:
    """A function that must be solved, with its requirements.

    ``weights`` replace those of all qualities, ``curves`` those of the qualities that they name. ``design`` is the
    design with which to begin. A higher ``priority`` is decided first. With ``always_improve``, a better design
    replaces one that is without errors.
    """

    name: str
    function: str
    requirements: tuple[Requirement, ...] = ()
    priority: float = 0.0
    always_improve: bool = False
    weights: Mapping[str, float] | None = None
    design: str | None = None
    curves: Mapping[str, Curve] | None = None


@dataclass(frozen=True, slots=True)
class Design:
    """A way to solve a function: a realization of a skill.

    ``components`` are those that it requires, ``requires`` the objectives of other functions that it needs.
    A design that ``is_rest`` has nothing active, and is never selected.
    """

    name: str
    function: str
    estimates: Mapping[str, float] = field(default_factory=dict)
    components: tuple[str, ...] = ()
    requires: tuple[Objective, ...] = ()
    context: str = DEFAULT_CONTEXT
    is_rest: bool = False


@dataclass(frozen=True, slots=True)
class Grounding:
    """A design that solves an objective now; ``requires`` are the objectives that it has in turn."""

    name: str
    objective: str
    design: str
    requires: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Model:
    """All that the files state, by IRI, in the order of the files.

    ``objectives`` are those of the files that no design requires; others come at run time.
    """

    functions: tuple[str, ...]
    designs: Mapping[str, Design]
    objectives: Mapping[str, Objective]
    groundings: Mapping[str, Grounding]
    components: Mapping[str, ComponentStatus]
    qualities: Mapping[str, Quality]

    def designs_of(self, function: str, context: str) -> tuple[Design, ...]:
        """Return the designs of a function in a context; those of the context Default where it has none."""
        own = [design for design in self.designs.values() if design.function == function and not design.is_rest]
        there = tuple(design for design in own if design.context == context)
        return there or tuple(design for design in own if design.context == DEFAULT_CONTEXT)

    def find(self, kind: str, name: str, called: str = "") -> str:
        """Return the IRI of a function, design, component, quality or objective, by its IRI or exact local name.

        ``called`` is the word for the kind in errors. Raises ValueError where there is none, or where the name means
        several.
        """
        known: Mapping[str, object] | tuple[str, ...] = {
            "function": dict.fromkeys(self.functions),
            "design": self.designs,
            "component": self.components,
            "quality": self.qualities,
            "objective": self.objectives,
        }[kind]
        if name in known:
            return name
        found = [iri for iri in known if local_name(iri) == name]
        if len(found) == 1:
            return found[0]
        if found:
            raise ValueError(f"the {called or kind} {name!r} is one of several: {', '.join(sorted(found))}")
        raise ValueError(no_such(called or kind, name, map(local_name, known)))


def objective_problems(model: Model, objective: Objective) -> tuple[str, ...]:
    """Return why an objective must be refused, empty if it need not be."""
    found: list[str] = []
    if objective.function not in model.functions:
        found.append(no_such("function", local_name(objective.function), map(local_name, model.functions)))
    bounded = {each.quality for each in objective.requirements}
    curves = objective.curves or {}
    for name in dict.fromkeys(
        (*(each.quality for each in objective.requirements), *(objective.weights or ()), *curves)
    ):
        if name not in model.qualities:
            found.append(no_such("quality", local_name(name), map(local_name, model.qualities)))
            continue
        has_curve = name in curves or model.qualities[name].curve is not None
        if model.qualities[name].direction is None and (name in bounded or not has_curve):
            found.append(f"the quality {local_name(name)!r} has no direction, must be HIGHER or LOWER in its file")
    found += [
        f"the bound of {local_name(each.quality)!r} is {each.bound!r}, must be a number"
        for each in objective.requirements
        if not is_number(each.bound)
    ]
    for name, weight in (objective.weights or {}).items():
        if not is_number(weight) or not 0 <= weight <= HIGHEST_WEIGHT:
            found.append(
                f"the weight of {local_name(name)!r} is {weight!r}, must be a number from 0 to {HIGHEST_WEIGHT:g}"
            )
    if objective.design is not None:
        design = model.designs.get(objective.design)
        if design is None:
            found.append(no_such("design", local_name(objective.design), map(local_name, model.designs)))
        elif design.function != objective.function:
            solved = local_name(design.function)
            found.append(f"the design {local_name(design.name)!r} solves {solved!r}, not the objective's function")
    return tuple(found)


REQUIRED: Final = "/"
"""Between the name of an objective and that of one that it requires."""


def is_of(name: str, objective: str) -> bool:
    """Return whether a name is that of an objective, or of one that it requires, also in turn."""
    return name == objective or name.startswith(objective + REQUIRED)


def is_number(value: object) -> bool:
    """Return whether a value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < float("inf")
