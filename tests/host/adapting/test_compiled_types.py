"""All types that components need as they are adapted are compiled before they start, once for all of them."""

from __future__ import annotations

import pytest

from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.model.adaptation import Outcome, SetParameters, Swap
from regraft.process.common_types import COMMON_TYPES
from tests.handover.parts import Ask
from tests.host.adapting import test_swap
from tests.host.adapting.compiling import Compiling, Names
from tests.host.conftest import Start
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow

CLASS = f"{Compiling.__module__}:{Compiling.__qualname__}"


def test_a_successor_that_is_adapted_compiles_none_of_regrafts_types(
    start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.host.conftest.HEAD", test_swap.HEAD)
    system = start(test_swap.SLOW.replace("tests.handover.parts:Totaller", CLASS))
    system.wait_running("adaptation_manager")
    test_swap.hears_on(system, 20)
    for change in (Swap("totaller", CLASS, {"offset": 3}), SetParameters("totaller", {"offset": 4})):
        report = test_swap.adapt(system, change)
        assert report.outcome is Outcome.APPLIED, report
    names = system.client.call("compiled", Ask(), Names, PATIENCE).names
    assert set(names) <= {type_of(cls).name for cls in COMMON_TYPES}
