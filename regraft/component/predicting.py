"""The estimates of a class, as far as they count."""

from __future__ import annotations

from collections.abc import Mapping

from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.model.qualities.qualities import Judged, QualityDescription, estimated, judged
from regraft.component.component import Component, InputQualities

NOTHING_FED: InputQualities = {}


def predicted(
    cls: type[Component],
    described: tuple[QualityDescription, ...],
    parameters: Mapping[str, PlainValue],
    context: Mapping[str, PlainValue],
    inputs: InputQualities = NOTHING_FED,
) -> Judged:
    """Return what a class predicts of its ``described`` qualities; raises what the class raises."""
    given = cls.estimate_from_inputs(dict(parameters), dict(context), inputs)
    return judged(estimated(described), given)
