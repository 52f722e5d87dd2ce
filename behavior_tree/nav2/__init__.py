"""Nav2's control nodes and decorators, with the semantics of its C++ plugins, so that Nav2's trees run unchanged.

    registry = Registry()
    register_nav2(registry)

Where Nav2 asks ROS, a node has a further input, connected to an entry of the top blackboard by default. The entries are
``robot_pose`` (DistanceController), ``robot_speed`` (SpeedController), ``goal_update`` and ``goals_update``
(GoalUpdater). The application writes these entries, or connects the inputs to others. `geometry` defines the form of
poses, goals and paths. ``request_pause`` and ``request_resume`` pause and resume a PauseResumeController. A function
given as ``offer_service`` may offer these as services.
"""

from typing import Final

from ..node_registry import Registry
from ..nodes.node import Node
from .distance import DistanceController
from .goals import GoalUpdatedController, GoalUpdater
from .paths import PathLongerOnApproach
from .pausing import OfferService, PauseResumeController
from .persistent import PersistentSequence
from .pipeline import NonblockingSequence, PipelineSequence
from .rates import RateController, SpeedController
from .recovery import RecoveryNode
from .round_robin import RoundRobin
from .single_trigger import SingleTrigger

NAV2_NODES: Final[tuple[type[Node], ...]] = (
    DistanceController,
    GoalUpdatedController,
    GoalUpdater,
    NonblockingSequence,
    PathLongerOnApproach,
    PauseResumeController,
    PersistentSequence,
    PipelineSequence,
    RateController,
    RecoveryNode,
    RoundRobin,
    SingleTrigger,
    SpeedController,
)


def register_nav2(registry: Registry, offer_service: OfferService | None = None) -> tuple[str, ...]:
    """Register Nav2's control nodes and decorators under Nav2's names.

    Args:
        registry: The registry that they are added to.
        offer_service: Makes the services of a PauseResumeController known, see `OfferService`.

    Returns:
        The names that are left out, because the registry has node types of these names already.
    """
    taken = []
    for node_class in NAV2_NODES:
        if node_class.__name__ in registry.manifests:
            taken.append(node_class.__name__)
        elif node_class is PauseResumeController:
            registry.register(node_class, offer_service=offer_service)
        else:
            registry.register(node_class)
    return tuple(taken)


__all__ = ["NAV2_NODES", "OfferService", "PauseResumeController", "register_nav2"]
