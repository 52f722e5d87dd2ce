"""Makes the model of a file from its text."""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from typing import Any, Final

from regraft.adaptation_manager.planners.metacontrol.skills.language.grammar import parsed
from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import (
    Better,
    Bound,
    Component,
    Configuration,
    Environment,
    Estimate,
    Field,
    Name,
    Parameter,
    Place,
    QualityField,
    QualityType,
    Realization,
    Requirement,
    Result,
    ResultKind,
    Skill,
    SkillFile,
    Value,
)

LONGEST_NUMBER: Final = 400
"""Characters of a number. Longer ones are out of range, and slow to convert."""
SPACE: Final = re.compile(r"\s+")
ESCAPE: Final = re.compile(r"\\(.)", re.DOTALL)
ESCAPED: Final = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f"}


class Lines:
    """The lines of a text, and the places of its parts."""

    def __init__(self, text: str, file: str) -> None:
        self._file = file
        self._starts = [0, *(found.end() for found in re.finditer("\n", text))]

    def place(self, start: int, end: int) -> Place:
        """Return the place of the characters from ``start`` to before ``end``."""
        first, last = bisect_right(self._starts, start), bisect_right(self._starts, end)
        return Place(self._file, first, start - self._starts[first - 1] + 1, last, end - self._starts[last - 1] + 1)


def model_of(text: str, file: str) -> SkillFile:
    """Return the model of a text; places name ``file``. Raises SyntaxMistake."""
    return _Builder(text, file).file(parsed(text))


class _Builder:
    def __init__(self, text: str, file: str) -> None:
        self._lines = Lines(text, file)
        self._file = file

    def _place(self, node: Any) -> Place:
        return self._lines.place(node._tx_position, node._tx_position_end)

    def _name(self, node: Any) -> Name:
        return Name(SPACE.sub("", node.text), self._place(node))

    def file(self, root: Any) -> SkillFile:
        """Return the content of a whole file."""
        if isinstance(root, str):  # textX has no object for a text of nothing but comments
            return SkillFile(self._file)
        declarations = [
            part for item in root.items for part in (item.items if _is(item, "SkillDefinitionSet") else [item])
        ]
        skills = [each for each in declarations if _is(each, "Skill")]
        realizations = [
            self.realization(part, each.name.text if _is(each, "Skill") else "")
            for each in declarations
            for part in (each.realizations if _is(each, "Skill") else [each] if _is(each, "Realization") else [])
        ]
        return SkillFile(
            self._file,
            imports=tuple(Name(_text(each.file), self._place(each)) for each in root.imports),
            qualities=tuple(self.quality(each) for each in declarations if _is(each, "QualityType")),
            contexts=tuple(self._name(each.name) for each in declarations if _is(each, "ContextType")),
            components=tuple(self.component(each) for each in declarations if _is(each, "ComponentType")),
            skills=tuple(self.skill(each) for each in skills),
            realizations=tuple(realizations),
        )

    def quality(self, node: Any) -> QualityType:
        """Return a quality type; of fields that are written twice the last one counts."""
        given: dict[str, Any] = {}
        for field in node.fields:
            if field.key == "range":
                given |= {"low": _number(field.low), "high": _number(field.high)}
            elif field.key == "better":
                given["better"] = Better(field.value)
            elif field.key == "measured":
                given["measured"] = _text(field.value)
            elif field.key == "curve":
                given["curve"] = tuple((_number(each.value), _number(each.utility)) for each in field.points)
            else:
                given["weight"] = _number(field.value)
        fields = tuple(QualityField(field.key, self._place(field)) for field in node.fields)
        return QualityType(node.name.text, self._place(node.name), **given, fields=fields)

    def skill(self, node: Any) -> Skill:
        """Return a skill without its realizations."""
        return Skill(
            name=node.name.text,
            qualities=tuple(self._name(each) for each in node.qualities),
            inputs=self._fields(node.inputs),
            outputs=self._fields(node.outputs),
            results=tuple(self._result(each) for each in node.results),
            place=self._place(node.name),
        )

    def _fields(self, blocks: Any) -> tuple[Field, ...]:
        return tuple(Field(each.name, each.type, self._place(each)) for block in blocks for each in block.fields)

    def _result(self, node: Any) -> Result:
        text = _text(node.text) if node.text else None
        return Result(ResultKind(node.kind), text, _number(node.number) if node.number else None, self._place(node))

    def realization(self, node: Any, around: str) -> Realization:
        """Return a realization; ``around`` is the skill that it stands in, empty for none."""
        of = self._name(node.skill) if node.skill else None
        return Realization(
            name=node.name.text,
            skill=around or (of.text if of else ""),
            of=of,
            components=tuple(self.component(each) for each in node.components),
            estimates=tuple(self._estimate(each) for each in node.estimates),
            requirements=tuple(self._requirement(each) for each in node.requirements),
            context=self._name(node.context),
            place=self._place(node.name),
        )

    def component(self, node: Any) -> Component:
        """Return a component, in a realization or on its own."""
        short = getattr(node, "short", None)
        given = [short] if short else node.configurations
        configurations = tuple(self._configuration(each) for each in given)
        return Component(node.name.text, bool(node.observable), configurations, self._place(node.name))

    def _configuration(self, node: Any) -> Configuration:
        name = self._name(node.name)
        parameters = tuple(self._parameter(each) for each in node.parameters) if getattr(node, "braced", None) else None
        return Configuration(name.text, parameters, name.place)

    def _parameter(self, node: Any) -> Parameter:
        value: Value | None = None
        if node.truth:
            value = node.truth == "true"
        elif node.text:
            value = _text(node.text)
        elif node.number:
            value = _value(node.number)
        ignored = _number(node.number) if node.text and node.number else None
        return Parameter(SPACE.sub("", node.name), value, self._place(node), ignored)

    def _estimate(self, node: Any) -> Estimate:
        environments = tuple(
            Environment(each.name, tuple((value.name, _number(value.value)) for value in each.values))
            for each in node.environments
        )
        return Estimate(node.name, _number(node.value), environments, self._place(node))

    def _requirement(self, node: Any) -> Requirement:
        bounds = tuple(Bound(each.name, each.operator, _number(each.value), self._place(each)) for each in node.bounds)
        return Requirement(node.skill.text, bounds, self._place(node.skill))


def _is(node: Any, rule: str) -> bool:
    return bool(type(node).__name__ == rule)


def _text(written: str) -> str:
    """Return a text without its quotes, as Xtext reads it."""
    return ESCAPE.sub(lambda found: ESCAPED.get(found[1], found[1]), written[1:-1])


def _number(written: str) -> float:
    """Return a number, infinite where it is out of range."""
    return float(SPACE.sub("", written)) if len(written) <= LONGEST_NUMBER else math.inf


def _value(written: str) -> int | float:
    """Return the value of a parameter: an integer without point and exponent."""
    whole = SPACE.sub("", written)
    if len(whole) > LONGEST_NUMBER or set(whole) & set(".eE"):
        return _number(written)
    return int(whole)
