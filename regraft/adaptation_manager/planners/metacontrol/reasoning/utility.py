"""The utility of a design: the weighted sum of its estimates, or of what curves make of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from regraft.adaptation_manager.planners.metacontrol.knowledge.curves import Curve
from regraft.adaptation_manager.planners.metacontrol.knowledge.model import Design, Objective, Quality
from regraft.adaptation_manager.planners.metacontrol.knowledge.statuses import Direction


@dataclass(frozen=True, slots=True)
class Share:
    """The share that a quality has of the utility: ``factor`` times the value, or times its utility on a curve.

    ``missing`` is the share of designs without an estimate: that of the worst value.
    """

    quality: str
    factor: float
    curve: Curve | None
    missing: float

    def of(self, value: float) -> float:
        """Return the share for a value."""
        return self.factor * (value if self.curve is None else self.curve.utility(value))


class Utility:
    """The utility of designs for an objective.

    Without a curve, qualities of which less is better have a negative sign. A curve has its own direction. The
    objective's weights and curves come before those of the qualities.
    """

    def __init__(self, objective: Objective, qualities: Mapping[str, Quality]) -> None:
        weights = objective.weights
        if weights is None:
            weights = {name: quality.weight for name, quality in qualities.items()}
        curves = objective.curves or {}
        shares = (_share(qualities[name], weight, curves.get(name)) for name, weight in weights.items() if weight)
        self.shares: tuple[Share, ...] = tuple(share for share in shares if share is not None)
        self._plain = tuple((each.quality, each.factor, each.missing) for each in self.shares if each.curve is None)
        self._curved = tuple(each for each in self.shares if each.curve is not None)

    def of(self, design: Design) -> float:
        """Return the utility of a design."""
        estimates = design.estimates
        total = 0.0
        for quality, factor, missing in self._plain:
            total += factor * estimates[quality] if quality in estimates else missing
        for share in self._curved:
            total += share.of(estimates[share.quality]) if share.quality in estimates else share.missing
        return total

    def parts(self, design: Design) -> dict[str, float]:
        """Return the share of each quality."""
        estimates = design.estimates
        return {
            share.quality: share.of(estimates[share.quality]) if share.quality in estimates else share.missing
            for share in self.shares
        }

    def missing(self, design: Design) -> tuple[str, ...]:
        """Return the qualities that have a share, and of which the design has no estimate."""
        return tuple(share.quality for share in self.shares if share.quality not in design.estimates)


def _share(quality: Quality, weight: float, own: Curve | None) -> Share | None:
    curve = own or quality.curve
    if curve is not None:
        return Share(quality.name, weight, curve, weight * curve.worst)
    if quality.direction is None:
        return None
    factor = -weight if quality.direction is Direction.LOWER else weight
    return Share(quality.name, factor, None, factor * quality.worst)
