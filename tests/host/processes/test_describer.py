"""Questions that take a process of their own each."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from regraft.bus.memory_bus import MemoryQuery
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.protocol.host import EstimateQualities
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.host.plan import HostPlan, moved
from regraft.host.zygote.describer import Describer
from regraft.host.zygote.zygote import Zygote


class NoProcesses:
    """Starts nothing, and notes the orders."""

    def __init__(self) -> None:
        self.started: list[str] = []
        self.orders: list[dict[str, Any]] = []

    def describe(self, name: str, order: dict[str, Any], folder: str, log: str) -> None:
        self.started.append(name)
        self.orders.append(order)


class FullDisk(NoProcesses):
    """Starts processes that cannot write: the file with what they call is there, and empty."""

    def describe(self, name: str, order: dict[str, Any], folder: str, log: str) -> None:
        super().describe(name, order, folder, log)
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


def test_estimators_get_paths_as_they_are_on_their_machine(tmp_path: Path) -> None:
    zygote = NoProcesses()
    plan = SimpleNamespace(
        stack_folder=tmp_path,
        folder=tmp_path,
        references={},
        found_here=lambda values: moved(values, {"/there": "/here"}),
    )
    describer = Describer(cast("Zygote", zygote), cast("HostPlan", plan))
    before, after = (ComponentSpec("far", parameters={"costs": f"/there/{name}.csv"}) for name in ("one", "other"))
    describer.ask_estimates(MemoryQuery("s/host/edge/estimate", codec.encode(EstimateQualities((before,), (after,)))))
    asked = codec.from_plain(zygote.orders[0]["estimate"], EstimateQualities)
    assert [spec.parameters["costs"] for spec in (*asked.before, *asked.after)] == ["/here/one.csv", "/here/other.csv"]
