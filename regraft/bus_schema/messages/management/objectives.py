"""Objectives: skills that a metacontroller is to provide, with the qualities that they must have.

A metacontroller NAME is a planner (`regraft.bus_schema.messages.planning`). It also offers:

- ``planners/NAME/objective``: an action, ``Objective`` with feedback and result ``ObjectiveStatus``
- ``planners/NAME/objectives/add``: ``ObjectivesRequest`` -> ``ObjectivesStatus``
- ``planners/NAME/objectives/list``: ``ObjectivesQuery`` -> ``ObjectivesStatus``
- ``planners/NAME/objectives/explain``: ``ExplanationQuery`` -> ``Explanation``
- ``planners/NAME/objectives/cancel``: ``ObjectivesCancellation`` -> ``ObjectivesStatus``
- ``planners/NAME/objectives/report``: ``ProgressReport`` -> ``ObjectiveStatus``
- ``planners/NAME/objectives/context``: ``ContextRequest`` -> ``ContextStatus``

It reads diagnostics (`regraft.bus_schema.messages.health.Diagnostic`) as MROS2's observers publish them. The text is
``Component status``, ``QA status``, ``binding error`` or ``Context status``, and ``values`` has one entry: the
component with ``FALSE``, ``TRUE`` or ``RECOVERED``, the quality with its number, or ``context`` with its name.
``subject`` names the objective that was measured or whose grounding has the error. A measurement with an empty subject
is one of all objectives.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Final

from regraft.bus_schema.annotations import PlainValue, Seconds, Text, Told, ToldBriefly
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.model.qualities.bounds import Comparison

OBJECTIVE: Final = "objective"
ADD: Final = "objectives/add"
LIST: Final = "objectives/list"
EXPLAIN: Final = "objectives/explain"
CANCEL: Final = "objectives/cancel"
REPORT: Final = "objectives/report"
CONTEXT: Final = "objectives/context"
"""The action and the services of a metacontroller, for ``planner_service``."""

COMPONENT_STATUS: Final = "Component status"
QUALITY_STATUS: Final = "QA status"
BINDING_ERROR: Final = "binding error"
CONTEXT_STATUS: Final = "Context status"
"""The texts of diagnostics that a metacontroller reads; the first three are those of MROS2."""

Name = Annotated[str, Text(200)]


class ObjectiveState(Enum):
    """The states of an objective (TOMASys and MROS)."""

    UNGROUNDED = "UNGROUNDED"
    IN_ERROR_FR = "IN_ERROR_FR"
    IN_ERROR_NFR = "IN_ERROR_NFR"
    IN_ERROR_COMPONENT = "IN_ERROR_COMPONENT"
    IN_PROGRESS = "IN_PROGRESS"


class Progress(Enum):
    """The progress of a skill, as its results classify it (MROS, section II-A)."""

    INPROGRESS = "INPROGRESS"
    SUCCESS = "SUCCESS"
    ERROR = "ERROR"


@message("regraft/CurvePoint")
@dataclass(frozen=True, slots=True)
class CurvePoint:
    """A point of a utility curve: the utility that a value of a quality is worth. Between points it is linear."""

    value: float
    utility: float


@message("regraft/Objective")
@dataclass(frozen=True, slots=True)
class Objective:
    """A skill that must be provided, with a bound for each required quality.

    A bound is the least value, or the highest where less is better. ``operators`` has the comparisons that the client
    wrote: one that contradicts the direction of its quality is refused. It is no part of what makes objectives equal.
    ``name`` is the skill's where it is empty.
    ``weights`` and ``curves`` replace those of the qualities in the utility. With ``always_improve`` a better
    realization replaces one without errors. ``realization`` is the one to begin with.
    ``inputs`` are those of the skill. ``task`` is what the objective is for: one task may have several.
    A higher ``priority`` is decided first.
    """

    skill: Name
    name: Name = ""
    requirements: dict[str, float] = field(default_factory=dict)
    priority: float = 0.0
    always_improve: bool = False
    weights: dict[str, float] | None = None
    curves: dict[str, tuple[CurvePoint, ...]] | None = None
    realization: Name = ""
    inputs: dict[str, PlainValue] = field(default_factory=dict)
    task: Name = ""
    operators: dict[str, Comparison] = field(default_factory=dict)


@message("regraft/Attempt")
@dataclass(frozen=True, slots=True)
class Attempt:
    """A realization that could not be entered, or that was left because it failed, and why."""

    stamp: Seconds
    realization: Name
    why: ToldBriefly


@message("regraft/ObjectiveStatus")
@dataclass(frozen=True, slots=True)
class ObjectiveStatus:
    """The state of an objective, and what provides it.

    ``parent`` is the objective whose realization requires this one, empty for one that a client gave. ``realization``
    and ``mode`` are empty while nothing provides it; ``since`` is when that began. ``measured`` has the qualities that
    count now, ``expected`` the realization's estimates. ``reasons`` are those of the errors, or why there is no
    realization; ``why`` is why there is this one. ``attempts`` are the latest failures, the newest last. ``ended`` is
    whether the objective is over.
    """

    objective: Name
    skill: Name
    state: ObjectiveState
    task: Name = ""
    parent: Name = ""
    priority: float = 0.0
    always_improve: bool = False
    requirements: dict[str, float] = field(default_factory=dict)
    realization: Name = ""
    mode: Name = ""
    since: Seconds | None = None
    progress: Progress = Progress.INPROGRESS
    measured: dict[str, float] = field(default_factory=dict)
    expected: dict[str, float] = field(default_factory=dict)
    reasons: tuple[ToldBriefly, ...] = ()
    why: ToldBriefly = ""
    attempts: tuple[Attempt, ...] = ()
    ended: bool = False


@message("regraft/ObjectivesRequest")
@dataclass(frozen=True, slots=True)
class ObjectivesRequest:
    """Add objectives, all of them or none. One of a present name and equal content is that one.

    The answer comes when each is provided or has been found impossible for now, unless ``wait`` is false.
    """

    objectives: tuple[Objective, ...]
    actor: Name = ""
    wait: bool = True


@message("regraft/ObjectivesQuery")
@dataclass(frozen=True, slots=True)
class ObjectivesQuery:
    """Report all objectives, or one and those that it requires."""

    objective: Name = ""


@message("regraft/ObjectivesStatus")
@dataclass(frozen=True, slots=True)
class ObjectivesStatus:
    """Objectives, each before those that its realization requires; ``context`` is the present one.

    ``resting`` has the realizations that failed and are left out for a while, as ``objective: realization``. Its
    values are the times at which that ends.
    """

    stamp: Seconds
    context: Name
    objectives: tuple[ObjectiveStatus, ...] = ()
    contexts: tuple[Name, ...] = ()
    resting: dict[str, Seconds] = field(default_factory=dict)


@message("regraft/ExplanationQuery")
@dataclass(frozen=True, slots=True)
class ExplanationQuery:
    """Explain the latest decision on an objective."""

    objective: Name


@message("regraft/Explanation")
@dataclass(frozen=True, slots=True)
class Explanation:
    """The reasons for and against each realization in the latest decision, as text and as plain data."""

    objective: Name
    stamp: Seconds
    text: Told
    decision: dict[str, PlainValue] = field(default_factory=dict)


@message("regraft/ObjectivesCancellation")
@dataclass(frozen=True, slots=True)
class ObjectivesCancellation:
    """End an objective, or all of a task. The answer comes when their components rest, unless ``wait`` is false."""

    objective: Name = ""
    task: Name = ""
    actor: Name = ""
    wait: bool = True


@message("regraft/ProgressReport")
@dataclass(frozen=True, slots=True)
class ProgressReport:
    """Report a skill's result as text or number, which the skill's results classify.

    SUCCESS and ERROR end the objective.
    """

    objective: Name
    text: str = ""
    number: float | None = None


@message("regraft/ContextRequest")
@dataclass(frozen=True, slots=True)
class ContextRequest:
    """Set the context in which realizations are chosen."""

    context: Name
    actor: Name = ""


@message("regraft/ContextStatus")
@dataclass(frozen=True, slots=True)
class ContextStatus:
    """The present context, and the one before."""

    context: Name
    before: Name
