"""Adaptation in the tree: decorators that change the running system for the sake of their child.

A plan in Python is a small class in any package. The executor's parameter ``nodes`` or the entry-point group
``regraft.tree_nodes`` names it:

    class AdjustMaxVelocity(AdaptPeriodically):
        safety = Input(float, description="0: touching, 1: nothing within range")
        power = Input(float, description="W")

        def plan(self) -> Step | None:
            if self.safety < 0.09 or self.power > 5.0:
                return Step(*self.target(), by=-0.08, low=0.10, high=0.26)
            if self.safety > 0.15 or self.power < 4.0:
                return Step(*self.target(), by=+0.08, low=0.10, high=0.26)
            return None
"""

from regraft.bus_schema.model.adaptation import Change, ChangeState, Connect, SetParameters
from regraft.services.bt_executor.adaptation.decorator import AdaptDecorator
from regraft.services.bt_executor.adaptation.results import Result
from regraft.services.bt_executor.adaptation.rules.desired_changes import DesiredChange, Impossible, Step
from regraft.services.bt_executor.adaptation.variants import (
    ADAPT_DECORATORS,
    AdaptOnAnyStatus,
    AdaptOnFailure,
    AdaptOnRunning,
    AdaptOnStart,
    AdaptOnSuccess,
    AdaptPeriodically,
)

__all__ = [
    "ADAPT_DECORATORS",
    "AdaptDecorator",
    "AdaptOnAnyStatus",
    "AdaptOnFailure",
    "AdaptOnRunning",
    "AdaptOnStart",
    "AdaptOnSuccess",
    "AdaptPeriodically",
    "Change",
    "ChangeState",
    "Connect",
    "DesiredChange",
    "Impossible",
    "Result",
    "SetParameters",
    "Step",
]
