"""Skills as written: data with the places of a file, made from the parsed text (paper, section II-A)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from regraft.bus_schema.model.lifecycle import State

Value = bool | int | float | str


@dataclass(frozen=True, slots=True)
class Place:
    """A range of a file. Lines and columns count from 1; the end is behind the last character."""

    file: str
    line: int
    column: int
    end_line: int
    end_column: int

    def __str__(self) -> str:
        """Return ``navigation.skills:3:14``."""
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Name:
    """A name where it is written."""

    text: str
    place: Place


class Better(Enum):
    """The direction in which a quality is better."""

    HIGHER = "higher"
    LOWER = "lower"


@dataclass(frozen=True, slots=True)
class QualityField:
    """A field of a quality type, as often as it is written."""

    key: str
    place: Place


@dataclass(frozen=True, slots=True)
class QualityType:
    """A quality that skills may list.

    ``low`` and ``high`` bound its values; None leaves them open. ``measured`` is the text of an expression whose value
    is the measured quality. ``weight`` is its share of the utility. ``curve`` has values with their utilities. All are
    None where they are left out.
    """

    name: str
    place: Place
    better: Better = Better.HIGHER
    low: float | None = None
    high: float | None = None
    measured: str | None = None
    weight: float | None = None
    curve: tuple[tuple[float, float], ...] | None = None
    fields: tuple[QualityField, ...] = ()


@dataclass(frozen=True, slots=True)
class Field:
    """An input or output of a skill: its name and type."""

    name: str
    type: str
    place: Place


class ResultKind(Enum):
    """The classes of a skill's progress."""

    SUCCESS = "success"
    ERROR = "error"
    INPROGRESS = "inprogress"


@dataclass(frozen=True, slots=True)
class Result:
    """A result of a skill, with the text and number that report it; either may be None."""

    kind: ResultKind
    text: str | None
    number: float | None
    place: Place


@dataclass(frozen=True, slots=True)
class Environment:
    """An environment in which an estimate holds, with its figures."""

    name: str
    values: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class Estimate:
    """The expected value of a quality (the QA model of the paper), everywhere or in ``environments``."""

    quality: str
    value: float
    environments: tuple[Environment, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Bound:
    """A quality that a required skill must have: ``operator`` is ``>=`` or ``<=``."""

    quality: str
    operator: str
    value: float
    place: Place


@dataclass(frozen=True, slots=True)
class Requirement:
    """Another skill that a realization needs while it is in use."""

    skill: str
    bounds: tuple[Bound, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a configuration. ``value`` is None where none is written, ``ignored`` a number behind a text."""

    name: str
    value: Value | None
    place: Place
    ignored: float | None = None


ACTIVE = State.ACTIVE.value


@dataclass(frozen=True, slots=True)
class Configuration:
    """A configuration of a component: a lifecycle state, or ``active.MODE``.

    ``parameters`` is None where the configuration is only named.
    """

    name: str
    parameters: tuple[Parameter, ...] | None
    place: Place

    @property
    def state(self) -> str:
        """The part before the first dot."""
        return self.name.partition(".")[0]

    @property
    def mode(self) -> str:
        """The part behind the first dot, empty without one."""
        return self.name.partition(".")[2]

    @property
    def is_active(self) -> bool:
        """Whether the component is active in it: ``inactive.X`` is not."""
        return self.state == ACTIVE


@dataclass(frozen=True, slots=True)
class Component:
    """A component with configurations, in a realization or declared on its own."""

    name: str
    observable: bool
    configurations: tuple[Configuration, ...]
    place: Place

    @property
    def target(self) -> Configuration:
        """The configuration that a realization brings it into: the first active one, else the first."""
        return next((each for each in self.configurations if each.is_active), self.configurations[0])

    @property
    def is_active(self) -> bool:
        """Whether one of its configurations is active."""
        return any(each.is_active for each in self.configurations)


@dataclass(frozen=True, slots=True)
class Realization:
    """A way to realize a skill: a system mode, its expected qualities, and the context for which it is made.

    ``skill`` is empty where the realization stands alone without ``of``. ``of`` is the skill that it names itself.
    """

    name: str
    skill: str
    of: Name | None
    components: tuple[Component, ...]
    estimates: tuple[Estimate, ...]
    requirements: tuple[Requirement, ...]
    context: Name
    place: Place

    def component(self, name: str) -> Component | None:
        """Return what the realization does with a component, None if nothing."""
        return next((each for each in self.components if each.name == name), None)


@dataclass(frozen=True, slots=True)
class Skill:
    """A function that the robot has: what it takes and gives, and the qualities that matter for it."""

    name: str
    qualities: tuple[Name, ...]
    inputs: tuple[Field, ...]
    outputs: tuple[Field, ...]
    results: tuple[Result, ...]
    place: Place


@dataclass(frozen=True, slots=True)
class SkillFile:
    """The content of one file. ``imports`` are the files that it names; ``components`` are those declared on their own.

    ``realizations`` has those in skills and those that stand alone, in the order of the file.
    """

    file: str
    imports: tuple[Name, ...] = ()
    qualities: tuple[QualityType, ...] = ()
    contexts: tuple[Name, ...] = ()
    components: tuple[Component, ...] = ()
    skills: tuple[Skill, ...] = ()
    realizations: tuple[Realization, ...] = ()


@dataclass(frozen=True, slots=True)
class SkillSet:
    """The content of a file and of all that it imports, imported files first."""

    file: str
    files: tuple[SkillFile, ...] = ()
    qualities: tuple[QualityType, ...] = ()
    contexts: tuple[Name, ...] = ()
    components: tuple[Component, ...] = ()
    skills: tuple[Skill, ...] = ()
    realizations: tuple[Realization, ...] = ()

    def skill(self, name: str) -> Skill | None:
        """Return a skill by its name, None if there is none."""
        return next((each for each in self.skills if each.name == name), None)

    def quality(self, name: str) -> QualityType | None:
        """Return the type of a quality, None if it is not declared."""
        return next((each for each in self.qualities if each.name == name), None)

    def realizations_of(self, skill: str) -> tuple[Realization, ...]:
        """Return the realizations of a skill, in their order."""
        return tuple(each for each in self.realizations if each.skill == skill)


def combined(file: str, files: tuple[SkillFile, ...]) -> SkillSet:
    """Return the content of several files as one."""
    return SkillSet(
        file,
        files,
        qualities=tuple(each for part in files for each in part.qualities),
        contexts=tuple(each for part in files for each in part.contexts),
        components=tuple(each for part in files for each in part.components),
        skills=tuple(each for part in files for each in part.skills),
        realizations=tuple(each for part in files for each in part.realizations),
    )
