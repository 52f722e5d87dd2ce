"""The use of a host: what its components are measured to take."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from regraft.bus_schema.annotations import Bounds, Count
from regraft.bus_schema.encoding.registry import message


@message("regraft/RunUsage")
@dataclass(frozen=True, slots=True)
class RunUsage:
    """The use by one component's process and all that it has started.

    ``cpu`` is in cores: the mean since the host was asked before, at first since the process began. ``memory`` is in
    MiB. A page that several processes share counts a part in each.
    """

    cpu: Annotated[float, Bounds(0.0)]
    memory: Annotated[float, Bounds(0.0)]


@message("regraft/HostUsage")
@dataclass(frozen=True, slots=True)
class HostUsage:
    """The use by the components of a host, standby runs included, and the size of its machine.

    ``cores`` are those that the host may use; ``memory`` and ``available`` are MiB of the whole machine.
    """

    host: str
    cores: Count
    memory: Annotated[float, Bounds(0.0)]
    available: Annotated[float, Bounds(0.0)]
    components: dict[str, RunUsage] = field(default_factory=dict)
