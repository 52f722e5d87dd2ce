"""Promises about components of several robots in one system: each asks and serves under the names of its own robot."""

from __future__ import annotations

import pytest

from regraft import CallFailed, Component, Output, every, service
from regraft.bus_schema.messages.quality import Quality
from regraft.client import Client
from regraft.testing import Rig
from tests.kit.parts import Number, Oracle, Walker
from tests.support.stepped.site import Site
from tests.support.waiting import wait_until


class Curious(Component):
    """Asks a service by the name that it is told, and gives an action a goal."""

    answers = Output(Number)

    @service("ask")
    async def ask(self, number: Number) -> Number:
        return await self.kit.call("double", number, Number, timeout=1.0)

    @service("ask_all")
    async def ask_all(self, number: Number) -> Number:
        return await self.kit.call("/double", number, Number, timeout=1.0)

    @service("send")
    async def send(self, number: Number) -> Number:
        return await self.kit.goal("walk", number, Number, Number).outcome()


class Hundredfold(Component):
    """Answers differently from the oracle."""

    @service("double")
    def double(self, number: Number) -> Number:
        return Number(100 * number.value)


class Named(Component):
    """Offers a service under its own name, and says how a requirement is met."""

    @service("who/{name}")
    def who(self, number: Number) -> Number:
        return number

    @every(seconds=0.05)
    def report(self) -> None:
        self.kit.report_quality(Quality(self.kit.now(), "Calm", "Safety"))


def test_a_short_name_means_the_robots_own_service_and_a_slash_the_shared_one() -> None:
    with Rig() as rig:
        rig.add(Oracle, "oracle")
        rig.add(Hundredfold, "left.oracle", scope="left")
        rig.add(Curious, "left.curious", scope="left")
        rig.add(Curious, "curious")
        assert rig.call("left/ask", Number(2), Number) == Number(200)
        assert rig.call("left/ask_all", Number(2), Number) == Number(4)
        assert rig.call("ask", Number(2), Number) == Number(4)
        assert rig.call("ask_all", Number(2), Number) == Number(4)


def test_a_goal_goes_to_the_robots_own_action() -> None:
    with Rig() as rig:
        left, right = (rig.add(Walker, f"{robot}.walker", scope=robot) for robot in ("left", "right"))
        rig.add(Curious, "left.curious", scope="left")
        assert rig.call("left/send", Number(3), Number) == Number(3)
        assert (left.ended, right.ended) == (["arrived"], [])


def test_a_service_that_the_robot_lacks_is_named_in_full() -> None:
    with Rig() as rig:
        rig.add(Oracle, "oracle")
        rig.add(Curious, "left.curious", scope="left")
        with pytest.raises(CallFailed, match="left/double: nobody offers this service"):
            rig.call("left/ask", Number(2), Number)
        assert len(rig.take_faults()) == 1


def test_a_class_may_offer_a_service_under_its_components_name() -> None:
    with Rig() as rig:
        rig.add(Named, "one")
        rig.add(Named, "left.two", scope="left")
        assert rig.call("who/one", Number(1), Number) == Number(1)
        assert rig.call("left/who/two", Number(2), Number) == Number(2)


def test_requirements_of_one_name_are_told_apart_by_their_robots() -> None:
    site = Site("memory")
    try:
        heard: set[str] = set()
        with Client(site.session(), "site", "listener") as client:
            client.requirements(lambda quality: heard.add(quality.requirement))
            for robot in ("left", "right"):
                site.start(Named, f"{robot}.named", scope=robot)
            site.start(Named, "named")
            wait_until(lambda: heard == {"left.Calm", "right.Calm", "Calm"}, "three requirements")
    finally:
        site.close()
