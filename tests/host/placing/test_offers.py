"""Hosts that join offer amounts and devices themselves: they count wherever a component is placed there."""

from __future__ import annotations

import json

import pytest

from regraft.bus_schema.messages.protocol.joining import JoinHost
from regraft.bus_schema.model.adaptation import Add, Move, Outcome
from regraft.bus_schema.model.architecture import ComponentSpec, TopicSpec
from regraft.bus_schema.model.hosts.offers import NO_OFFER, HostOffer
from regraft.security.host_proof import seal_of
from tests.host.placing.test_capability import EDGE, THRIFTY
from tests.host.several import Site
from tests.support.commands import run
from tests.support.waiting import wait_until

pytestmark = pytest.mark.slow

AREA = "hosts.arm.amounts.accelerator_area"


def add(name: str, cls: str, port: str, topic: str) -> Add:
    spec = ComponentSpec(cls=f"tests.host.parts:{cls}", host="arm", connections={port: topic})
    return Add(name, spec, (TopicSpec(topic, "host_tests/Tick"),))


def offered(site: Site) -> dict[str, tuple[float | None, float, float | None]]:
    """Return what host ``arm`` offers, by amount: offered, declared, measured."""
    shown = run("host", "--resources", "--json", "--system", site.system.info.system)
    assert shown.returncode == 0, shown.stderr
    arm = next(host for host in json.loads(shown.stdout)["hosts"] if host["host"] == "arm")
    return {each["name"]: (each["offered"], each["declared"], each["measured"]) for each in arm["amounts"]}


def test_a_component_is_placed_on_a_joined_host_as_long_as_there_is_enough(site: Site) -> None:
    system = site.up(THRIFTY.replace("host: edge", "host: local"), "{local: {amounts: {accelerator_area: 1}}}")
    first = site.join("arm", "", "--offer", "accelerator_area=0.8", "--offer", "fpga")
    assert site.adapt(add("fast", "Fast", "ticks", "quick")).outcome is Outcome.APPLIED
    site.wait_active("fast")
    assert offered(site)["accelerator_area"] == (0.8, 0.5, None)
    further = site.adapt(add("other", "Fast", "ticks", "more"))
    assert further.outcome is Outcome.REJECTED
    assert {AREA, "resources.devices"} <= {one.field for one in further.violations}
    assert site.adapt(Move("thrifty", "arm")).outcome is Outcome.APPLIED
    assert site.adapt(add("third", "Thrifty", "ticks", "third")).outcome is Outcome.REJECTED
    first.process.kill()
    first.process.wait()
    again = site.begin("arm", "", "--offer", "accelerator_area=0.5", "--offer", "fpga")
    assert again.process.wait() == 2
    assert "offer.accelerator_area: host 'arm' offers 0.5" in again.log.read_text()
    site.join("arm", "", "--offer", "accelerator_area=2", "--offer", "fpga")
    assert site.adapt(add("third", "Thrifty", "ticks", "third")).outcome is Outcome.APPLIED
    wait_until(lambda: site.host_of("third") == "arm", "the third to be on arm")
    assert system.info.system


def test_what_the_stack_names_for_a_host_is_not_offered_again(site: Site) -> None:
    site.up(THRIFTY, f"{{{EDGE}}}")
    refused = site.begin("edge", "", "--offer", "accelerator_area=3", "--offer", "fpga")
    assert refused.process.wait() == 2
    told = refused.log.read_text()
    assert "offer.accelerator_area: the stack names 1 for host 'edge' already: leave it out here or there" in told
    assert "offer.fpga: the stack names this device for host 'edge' already" in told


def test_the_rescue_counts_what_a_joined_host_offers(site: Site) -> None:
    rules = "{when_lost: {move_to: arm}, lost_after: 1.0, amounts: {accelerator_area: 1}}"
    system = site.up(THRIFTY, f"{{edge: {rules}, arm: {{}}}}")
    lost = site.join()
    site.join("arm", "", "--offer", "accelerator_area=0.2")
    site.wait_active("thrifty")
    lost.process.kill()
    wait_until(lambda: bool(system.said("host.stranded", "edge")), "what has no room to be named")
    (event,) = system.said("host.stranded", "edge")
    assert "offers 0.2 accelerator_area, but its components need 0.25 (thrifty 0.25)" in event.text


def test_the_seal_of_a_host_that_joins_covers_its_offer() -> None:
    offers = (NO_OFFER, HostOffer(amounts={"power": 1.0}), HostOffer(amounts={"power": 2.0}), HostOffer(cpu=1.0))
    seals = {seal_of(JoinHost("edge", "this process", offer=offer), b"key") for offer in offers}
    assert len(seals) == len(offers)
