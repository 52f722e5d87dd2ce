"""What a component may use: a host ends whatever has more memory, and nobody has more files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from regraft import CallFailed
from regraft.bus_schema.messages.protocol.host import ProcessState
from regraft.bus_schema.model.adaptation import Add, Outcome, Swap
from regraft.bus_schema.model.architecture import ComponentSpec, Limits, TopicSpec
from regraft.host.watchdog.memory_use import resident_size
from tests.host.conftest import HEAD
from tests.host.parts import Tick
from tests.host.several import Site
from tests.support.systems import System, all_ended, home
from tests.support.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

GREEDY = "  greedy: {class: 'tests.host.parts:Greedy', limits: {memory: 200 MiB, files: 64}}\n"
HOLDS = 'python3 -c "import time; kept = bytes(1) * 200_000_000; time.sleep(1000)"'
NEST = f"[sh, -c, '{HOLDS} & wait']"
BACKGROUND = f"[sh, -c, '(setsid {HOLDS} &) ; exec sleep 1000']"
LIMITED = f"""\
  nest:
    {{command: {NEST}, managed: false, limits: {{memory: 100 MB}}, restart: {{limit: 1, backoff: 0.01}}}}
  background: {{command: {BACKGROUND}, managed: false, restart: never, limits: {{memory: 100 MB}}}}
  sharing: {{class: 'tests.host.shared:Sharing', connect: {{ticks: others}}, limits: {{memory: 150 MiB}}}}
"""
MUCH = 400
SILENT_FOR = 0.8
"""Seconds after which it is asked no more, before the request is repeated to the next run."""


def _eats_too_much(system: System, name: str = "greedy") -> None:
    system.ask_until_it_ends(name, lambda: system.client.call("eat", Tick(MUCH), Tick, SILENT_FOR))


def _files(system: System) -> int:
    return system.client.call("files", Tick(0), Tick, PATIENCE).count


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    """Return a system of components with limits, each for one test; greedy is for two."""
    folder = tmp_path_factory.mktemp("limits")
    head = HEAD.replace("components:", "  others: {type: host_tests/Tick}\ncomponents:")
    (folder / "stack.yaml").write_text(head + GREEDY + LIMITED)
    with home(folder / "home"), all_ended() as started:
        started.append(System(folder / "stack.yaml"))
        yield started[0]


def test_a_component_with_too_much_memory_is_ended_with_the_arithmetic_and_restarted(system: System) -> None:
    run = system.wait_running("greedy").incarnation
    _eats_too_much(system)
    again = system.wait_running("greedy", run + 1)
    assert again.exit_reason.startswith("it used ")
    assert again.exit_reason.endswith(" MiB of memory and may use 200.0 MiB, so it was killed")
    told, *_ = system.said("component.over_limit", "greedy")  # the next run may have been asked, too
    assert told.details["allowed"] == 200.0
    assert told.details["used"] > 200.0
    assert system.client.call("eat", Tick(10), Tick, PATIENCE).count == 10


def test_a_component_that_keeps_using_too_much_is_quarantined(system: System) -> None:
    over = system.wait_for("nest", lambda p: p.state is ProcessState.QUARANTINED, "quarantined")
    assert "may use 95.4 MiB" in over.exit_reason
    assert len(system.said("component.over_limit", "nest")) == 2


def test_what_a_program_has_put_into_the_background_counts_too(system: System) -> None:
    over = system.wait_for("background", lambda p: p.state is ProcessState.STOPPED, "ended")
    assert "may use 95.4 MiB" in over.exit_reason


def test_memory_that_all_components_share_is_not_counted_in_each(system: System) -> None:
    pid = system.wait_running("sharing").pid
    assert resident_size(pid) > 200.0
    wait_until(lambda: system.client.call("begun", Tick(0), Tick, PATIENCE).count > 50, "some looks at it")
    assert system.processes()["sharing"].incarnation == 1


def test_a_component_without_files_left_says_so_and_is_well_again_after_its_restart(system: System) -> None:
    run = system.wait_running("greedy").incarnation
    assert _files(system) == 64
    for _ in range(2):
        with pytest.raises(CallFailed, match="Too many open files"):
            system.client.call("open", Tick(100), Tick, PATIENCE)
    wait_until(lambda: system.said("component.fault", "greedy"), "the fault to be told")
    assert "Too many open files" in system.said("component.fault", "greedy")[0].text
    _eats_too_much(system)
    system.wait_running("greedy", run + 1)
    assert system.client.call("open", Tick(10), Tick, PATIENCE).count == 10


def test_a_handler_may_take_as_long_as_the_stack_says(site: Site) -> None:
    plodding = "  plodding: {class: 'tests.host.parts:Plodding', limits: {handler_timeout: 5.0}}\n"
    system = site.up(plodding, "[edge]")
    first = site.wait_active("plodding")
    assert system.client.call("plod", Tick(7), Tick, PATIENCE).count == 7
    assert site.adapt(Swap("plodding", "", {"step": 2})).outcome is Outcome.APPLIED
    assert system.client.call("plod", Tick(8), Tick, PATIENCE).count == 8
    assert site.wait_active("plodding", first) == first + 1
    assert not system.said("component.hung", "plodding")


def test_limits_of_the_whole_stack_hold_for_who_has_none_and_for_what_comes_later(site: Site) -> None:
    greedy = "  greedy: {class: 'tests.host.parts:Greedy', host: edge}\n"
    system = site.up(greedy, "[edge]\nlimits: {memory: 1 GB, files: 100}")
    site.join()
    first = site.wait_active("greedy")
    assert _files(system) == 100
    assert site.adapt(Swap("greedy", "", {"step": 2})).outcome is Outcome.APPLIED
    site.wait_active("greedy", first)
    assert _files(system) == 100
    renamed = {name: f"other/{name}" for name in ("eat", "open", "files")}
    spec = ComponentSpec(cls="tests.host.parts:Greedy", connections={"ticks": "others"}, services=renamed)
    others = TopicSpec("others", "host_tests/Tick")
    own = replace(spec, limits=Limits(files=50))
    assert site.adapt(Add("other", own, topics=(others,))).outcome is Outcome.APPLIED
    assert system.client.call("other/files", Tick(0), Tick, PATIENCE).count == 50


def test_a_successor_that_uses_too_much_is_ended_and_its_incumbent_goes_on(site: Site) -> None:
    system = site.up("  ticker: {class: 'tests.host.parts:Ticker', limits: {memory: 150 MiB}}\n", "[edge]")
    first = site.wait_active("ticker")
    report = site.adapt(Swap("ticker", "tests.host.parts:Swelling"))
    assert report.outcome is Outcome.ROLLED_BACK
    assert system.said("component.over_limit", "ticker")
    status = system.client.components()["ticker"].status
    assert status is not None
    assert status.incarnation == first
