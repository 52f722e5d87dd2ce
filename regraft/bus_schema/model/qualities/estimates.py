"""The estimate of an adaptation, made before anything is touched."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from regraft.bus_schema.annotations import Count, Seconds, ToldBriefly
from regraft.bus_schema.encoding.registry import message


class Basis(Enum):
    """The source of a duration: the same kind of step with the same class, the same kind of step, or nothing."""

    CLASS = "class"
    KIND = "kind"
    ASSUMED = "assumed"


@message("regraft/StepEstimate")
@dataclass(frozen=True, slots=True)
class StepEstimate:
    """How long a step of the plan is expected to take: half of its like took at most ``median``, 95 % at most ``p95``.

    ``samples`` is how many there were; with none, both are assumed.
    """

    number: Count
    component: str
    action: ToldBriefly
    median: Seconds
    p95: Seconds
    samples: Count
    basis: Basis


class Source(Enum):
    """Where a figure comes from.

    ``estimated`` by the class; ``assumed``: by the class too, but in a cycle of connections, from what was measured
    last; ``measured`` last by the running component; ``unknown``.
    """

    ESTIMATED = "estimated"
    ASSUMED = "assumed"
    MEASURED = "measured"
    UNKNOWN = "unknown"


@message("regraft/Figure")
@dataclass(frozen=True, slots=True)
class Figure:
    """The value of a quality, None if it is unknown; ``why`` it is that, or what it rests on."""

    value: float | None = None
    source: Source = Source.UNKNOWN
    why: ToldBriefly = ""


@message("regraft/QualityEstimate")
@dataclass(frozen=True, slots=True)
class QualityEstimate:
    """One of a component's qualities, as predicted ``before`` and ``after`` an adaptation, and where that comes from.

    An unknown value is None: the component is not there, not active, or its class cannot predict it.
    """

    component: str
    quality: str
    before: float | None = None
    after: float | None = None
    before_source: Source = Source.UNKNOWN
    after_source: Source = Source.UNKNOWN
    before_why: ToldBriefly = ""
    after_why: ToldBriefly = ""


@message("regraft/Estimate")
@dataclass(frozen=True, slots=True)
class Estimate:
    """Expected seconds of the wall clock, by step and in all, and the qualities that change.

    ``p95`` is the sum of the steps' own: all of them being slow at once is rarer than that. Time to be confirmed, and
    in which removed processes end, is not counted.
    """

    median: Seconds
    p95: Seconds
    steps: tuple[StepEstimate, ...] = ()
    qualities: tuple[QualityEstimate, ...] = ()
