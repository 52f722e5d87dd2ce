"""Routes: ways over a graph of places, as Nav2's route server finds them."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from regraft.bus_schema.annotations import Count, Metres
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.geometry import FramedPose
from regraft.bus_schema.messages.nav2.paths import Path


class RouteError(IntEnum):
    """The error codes of ``compute_route``."""

    NONE = 0
    REJECTED = 1
    NOT_SENT = 2
    UNKNOWN = 400
    NO_POSE = 401
    NO_VALID_GRAPH = 402
    UNKNOWN_NODE = 403
    TIMEOUT = 404
    NO_VALID_ROUTE = 405


@message("regraft/RouteNode")
@dataclass(frozen=True, slots=True)
class RouteNode:
    """A place of the graph, in the map."""

    id: Count
    x: Metres
    y: Metres


@message("regraft/RouteEdge")
@dataclass(frozen=True, slots=True)
class RouteEdge:
    """A straight way from one node to another, by their ids; ``both_ways`` it leads back, too.

    ``cost`` counts for each metre and is greater than 0. A value other than 1 makes the way better or worse.
    """

    start: Count
    end: Count
    both_ways: bool = True
    cost: float = 1.0


@message("regraft/Route")
@dataclass(frozen=True, slots=True)
class Route:
    """The nodes of a way over the graph, in their order, and its cost."""

    nodes: tuple[RouteNode, ...] = ()
    cost: float = 0.0


@message("regraft/ComputeRoute")
@dataclass(frozen=True, slots=True)
class ComputeRoute:
    """Goal: find a way over the graph.

    With ``use_poses`` it leads between the nodes nearest to ``start`` and ``goal``, else between nodes by their ids.
    Without ``use_start`` it begins at the node nearest to the robot.
    """

    start: FramedPose | None = None
    goal: FramedPose | None = None
    start_id: Count = 0
    goal_id: Count = 0
    use_start: bool = False
    use_poses: bool = False


@message("regraft/ComputedRoute")
@dataclass(frozen=True, slots=True)
class ComputedRoute:
    """Result: the route, and the path along its edges; or the error."""

    route: Route = field(default_factory=Route)
    path: Path = field(default_factory=Path)
    error_code: Count = 0
    error_msg: str = ""
