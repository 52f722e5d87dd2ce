"""Objectives of clients in the terms of the knowledge base: names, directions of bounds, and types of inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from regraft import RefusalCode, RequestRefused
from regraft.adaptation_manager.planners.metacontrol.knowledge import model as knowledge
from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve
from regraft.adaptation_manager.planners.metacontrol.knowledge.rules.terms import local_name
from regraft.adaptation_manager.planners.metacontrol.knowledge.vocabulary import DEFAULT_CONTEXT
from regraft.adaptation_manager.planners.metacontrol.skills.meaning import CONTEXTS
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import (
    Field,
    Result,
    ResultKind,
    Skill,
    SkillSet,
)
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import known_types
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.geometry import Pose
from regraft.bus_schema.messages.management.objectives import CurvePoint, Objective, Progress
from regraft.bus_schema.suggestions import no_such

PLAIN_TYPES: Final[dict[str, tuple[type, ...]]] = {
    "bool": (bool,),
    "int": (int,),
    "float": (int, float),
    "string": (str,),
}
MAX_SHOWN: Final = 4096
"""Characters of a refusal that repeats what a client gave."""
CALLED: Final = {"function": "skill", "design": "realization"}
"""Kinds of the knowledge base, in the words of files of skills."""
POSE: Final = "PoseStamped"
PROGRESS: Final = {
    ResultKind.SUCCESS: Progress.SUCCESS,
    ResultKind.ERROR: Progress.ERROR,
    ResultKind.INPROGRESS: Progress.INPROGRESS,
}


class Translator:
    """Turns clients' names into those of a model. ``skills`` has inputs and results, None where nothing is known."""

    def __init__(self, model: knowledge.Model, skills: SkillSet | None) -> None:
        self._model = model
        self._skills = skills

    def contexts(self) -> tuple[str, ...]:
        """Return the contexts that there are: the published ones, those declared, and those of designs."""
        declared = (each.text for each in (self._skills.contexts if self._skills else ()))
        designs = (each.context for each in self._model.designs.values())
        return tuple(dict.fromkeys([DEFAULT_CONTEXT, *CONTEXTS, *declared, *designs]))

    def objective(self, given: Objective, where: str = "") -> knowledge.Objective:
        """Return an objective of the knowledge base; raises RequestRefused, with the field behind ``where``."""
        if not given.name.strip() or not given.name.isprintable() or any(mark in given.name for mark in "/#"):
            raise _refused(f"{given.name!r}: must be a printable name without '/' and '#'", f"{where}name")
        function = self._find("function", given.skill, f"{where}skill")
        requirements = tuple(
            self._requirement(name, bound, function, f"{where}requirements.{name}")
            for name, bound in given.requirements.items()
        )
        self._check_operators(given, {local_name(each.quality): each.quality for each in requirements}, where)
        weights = None
        if given.weights is not None:
            weights = {self._find("quality", name, f"{where}weights.{name}"): w for name, w in given.weights.items()}
        curves = {
            self._find("quality", name, f"{where}curves.{name}"): _curve(points, f"{where}curves.{name}")
            for name, points in (given.curves or {}).items()
        }
        design = self._design(given.realization, function, f"{where}realization") if given.realization else None
        self._check_inputs(given, f"{where}inputs")
        found = knowledge.Objective(
            given.name,
            function,
            requirements,
            given.priority,
            given.always_improve,
            weights,
            design,
            curves=curves or None,
        )
        problems = knowledge.objective_problems(self._model, found)
        if problems:
            raise _refused("; ".join(problems), where.rstrip("."))
        return found

    def progress(self, skill: str, text: str, number: float | None) -> Progress:
        """Return what a result of a skill means; raises RequestRefused for one that it does not have."""
        described = self._skill(skill)
        results = described.results if described else ()
        for each in results:
            if _is_result(each, text, number):
                return PROGRESS[each.kind]
        known = [str(each.text if each.text is not None else each.number) for each in results]
        for name in Progress:
            if text.upper() == name.value:
                return name
        raise _refused(no_such("result", text or str(number), [*known, *(each.value for each in Progress)]), "text")

    def _design(self, name: str, function: str, where: str) -> str:
        """Return the design that a realization is; one whose name several skills have is meant by the file's name."""
        own = [iri for iri, design in self._model.designs.items() if design.function == function]
        for wanted in (name, f"{local_name(function)}_{name}"):
            for iri in own:
                if local_name(iri) == wanted:
                    return iri
        return self._find("design", name, where)

    def _requirement(self, name: str, bound: float, function: str, where: str) -> knowledge.Requirement:
        quality = self._model.qualities[self._quality(name, function, where)]
        if not quality.lowest <= bound <= quality.highest:
            raise _refused(f"is {bound:g}, must be from {quality.lowest:g} to {quality.highest:g}", where)
        return knowledge.Requirement(quality.name, bound)

    def _quality(self, name: str, function: str, where: str) -> str:
        quality = self._find("quality", name, where)
        described = self._skill(function)
        listed = [each.text for each in described.qualities] if described else []
        if listed and local_name(quality) not in listed:
            skill = local_name(function)
            raise _refused(f"the skill {skill!r} does not list it; it lists: {', '.join(listed)}", where)
        return quality

    def _check_operators(self, given: Objective, qualities: Mapping[str, str], where: str) -> None:
        """Refuse a comparison of no bound, or one against the direction of its quality."""
        for name, comparison in given.operators.items():
            field = f"{where}operators.{name}"
            if name not in given.requirements:
                raise _refused(no_such("bound", name, given.requirements), field)
            sign = self._model.qualities[qualities[local_name(name)]].sign
            if comparison.value != sign:
                raise _refused(f"{comparison.value} contradicts the direction of {name!r}: must be {sign}", field)

    def _find(self, kind: str, name: str, where: str) -> str:
        try:
            return self._model.find(kind, name, CALLED.get(kind, ""))
        except ValueError as error:
            raise _refused(str(error), where) from None

    def _skill(self, name: str) -> Skill | None:
        return self._skills.skill(local_name(name)) if self._skills else None

    def _check_inputs(self, given: Objective, where: str) -> None:
        skill = self._skill(given.skill)
        if skill is None:
            return
        fields = {each.name: each for each in skill.inputs}
        for name, value in given.inputs.items():
            if name not in fields:
                raise _refused(no_such("input", name, fields), f"{where}.{name}")
            problem = _misfit(fields[name], value)
            if problem:
                raise _refused(problem, f"{where}.{name}")


def _curve(points: Sequence[CurvePoint], where: str) -> Curve:
    try:
        return Curve(tuple((each.value, each.utility) for each in points))
    except ValueError as error:
        raise _refused(str(error), where) from None


def _is_result(result: Result, text: str, number: float | None) -> bool:
    if result.text is not None and result.text == text:
        return True
    return result.number is not None and result.number == number


def _misfit(field: Field, value: PlainValue) -> str:
    """Return why a value is not of a field's type, empty if it is."""
    if field.type in PLAIN_TYPES:
        is_truth = isinstance(value, bool)
        fits = isinstance(value, PLAIN_TYPES[field.type]) and is_truth == (field.type == "bool")
        return "" if fits else f"{value!r}: must be of the type {field.type}"
    types = {kind.name: kind.cls for kind in known_types()}
    try:
        codec.from_plain(value, Pose if field.type == POSE else types[field.type])
    except (BadMessage, KeyError) as error:
        return f"must be of the type {field.type}: {error}"
    return ""


def _refused(why: str, where: str) -> RequestRefused:
    return RequestRefused(_short(why), RefusalCode.INVALID, field=_short(where))


def _short(text: str) -> str:
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]} ..."
