"""Questions that take a process of their own each."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from regraft.bus.memory_bus import MemoryQuery
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.host import EstimateQualities
from regraft.host.plan import HostPlan
from regraft.host.zygote.describer import Describer
from regraft.host.zygote.zygote import Zygote


class FullDisk:
    """Starts processes that cannot write: the file with what they call is there, and empty."""

    def __init__(self) -> None:
        self.started: list[str] = []

    def describe(self, name: str, order: dict[str, Any], folder: str, log: str) -> None:
        self.started.append(name)
        Path(order["answer"]).with_suffix(".under_way").touch()


def test_an_estimate_on_a_full_disk_is_answered_and_not_tried_for_ever(tmp_path: Path) -> None:
    disk = FullDisk()
    plan = SimpleNamespace(stack_folder=tmp_path, folder=tmp_path, references={}, found_here=lambda values: values)
    describer = Describer(cast("Zygote", disk), cast("HostPlan", plan))
    query = MemoryQuery("s/host/local/estimate", codec.encode(EstimateQualities((), ())))
    describer.ask_estimates(query)
    assert describer.takes({"name": disk.started[-1], "ended": 1, "incarnation": 0, "code": 1})
    assert query.answered.is_set()
    assert len(disk.started) == 1
    assert list(tmp_path.iterdir()) == []
