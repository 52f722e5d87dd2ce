"""The end of a system reaches its other hosts, too."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from regraft.bus_schema.model.hosts.host_state import HostState
from tests.host.several import TICKER, WAIT, Site
from tests.support.hosts import wait_state
from tests.support.links import Cable
from tests.support.waiting import PATIENCE

pytestmark = pytest.mark.slow


def test_a_host_whose_link_broke_just_before_the_end_ends_in_good_order(site: Site) -> None:
    system = site.up(TICKER, WAIT)
    cable = Cable(int(system.info.endpoint.rpartition(":")[2]))
    try:
        edge = site.join(endpoint=f"tcp/127.0.0.1:{cable.port}")
        site.wait_active("ticker")
        cable.plugged = False
        cable.cut()
        wait_state(system, "edge", HostState.SILENT)
        with ThreadPoolExecutor(1) as pool:
            ending = pool.submit(system.end)
            cable.plugged = True
            assert ending.result(PATIENCE) == 0
        assert edge.process.wait(PATIENCE) == 0
        assert "the system ends" in edge.log.read_text()
    finally:
        cable.close()
