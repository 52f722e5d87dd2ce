"""A component that reports what no message can carry has a fault; its process lives, and its heartbeat continues."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from regraft import Component, Input, every
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.messages.health import Level
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.bus_schema.model.system_topics import DIAGNOSTICS
from regraft.runtime import loop
from regraft.runtime.data.own_news import OwnNews
from regraft.testing import Rig
from tests.kit.parts import Number, Speechless

SURROGATE = "no file caf\udce9"
"""A file name that is not UTF-8, as Python reads it from the system."""


class Reporter(Component):
    """Reports, fails and raises with what a test gives it."""

    heard = Input(Number, topic="numbers")

    def __init__(self) -> None:
        self.detail = "waits"
        self.values: dict[str, Any] = {"hits": 1}
        self.why = ""
        self.raised: BaseException | None = None

    @heard.handler
    def show(self, number: Number) -> None:
        self.kit.set_status_text(self.detail, **self.values)
        if self.why:
            self.kit.fail(self.why)

    @every(seconds=1.0)
    def work(self) -> None:
        if self.raised is not None:
            raise self.raised


def _beat(rig: Rig) -> None:
    """Have the heartbeat put, as its time comes under the real clock."""
    runtime = rig.runtimes["reporter"]
    runtime.reporter.next_beat = 0.0
    loop.pump(runtime)
    assert runtime.reporter.next_beat > 0.0


@pytest.mark.parametrize(
    ("detail", "values"),
    [
        ("seen", {"hits": np.int64(3)}),
        ("seen", {"hits": math.nan}),
        ("seen", {"hits": object()}),
        (SURROGATE, {}),
    ],
)
def test_a_status_that_no_message_can_carry_is_one_fault_and_changes_nothing(
    detail: str, values: dict[str, Any]
) -> None:
    with Rig() as rig:
        reporter = rig.add(Reporter)
        rig.publish("numbers", Number(1))
        reporter.detail, reporter.values = detail, values
        rig.publish("numbers", Number(2))
        (fault,) = rig.take_faults()
        assert "BadMessage" in fault
        _beat(rig)
        status = rig.status("reporter")
        assert (status.detail, status.values) == ("waits", {"hits": 1})
        assert rig.take_faults() == []


def test_a_status_holds_what_was_reported_also_when_its_parts_change_later() -> None:
    with Rig() as rig:
        reporter = rig.add(Reporter)
        reporter.values = {"seen": ["box"]}
        rig.publish("numbers", Number(1))
        reporter.values["seen"].append(np.int64(3))
        _beat(rig)
        assert rig.status("reporter").values == {"seen": ["box"]}


def test_a_diagnostic_in_simulated_time_holds_what_was_reported_also_when_its_parts_change_later() -> None:
    with Rig() as rig:
        rig.add(Reporter)
        reporter, news, seen = rig.runtimes["reporter"].reporter, OwnNews(), ["box"]
        news.want((DIAGNOSTICS,))
        reporter.news = news
        reporter.diagnose("camera", Level.OK, "sees", seen=seen)
        seen.append(np.int64(3))  # type: ignore[arg-type]
        told = news.take(reporter.status)
        assert told is not None
        assert [diagnostic.values for diagnostic in told.diagnostics] == [{"seen": ["box"]}]
        codec.encode(told)


def test_an_exception_with_a_text_that_no_message_can_carry_is_a_fault_and_no_more() -> None:
    with Rig() as rig:
        rig.add(Reporter).raised = ValueError(SURROGATE)
        rig.advance(1.0)
        assert rig.take_faults() == ["reporter: work: ValueError: no file caf\\udce9"]
        _beat(rig)
        assert rig.status("reporter").error == "work: ValueError: no file caf\\udce9"
        assert rig.state("reporter") is State.ACTIVE


def test_an_exception_without_a_text_is_a_fault_and_no_more() -> None:
    with Rig() as rig:
        rig.add(Reporter).raised = Speechless()
        rig.advance(1.0)
        assert rig.take_faults() == ["reporter: work: Speechless"]
        assert rig.state("reporter") is State.ACTIVE


def test_a_component_fails_by_itself_with_any_text() -> None:
    with Rig() as rig:
        rig.add(Reporter).why = SURROGATE
        rig.publish("numbers", Number(1))
        assert rig.state("reporter") is State.UNCONFIGURED
        assert rig.status("reporter").failure == "no file caf\\udce9"
        rig.transition("reporter", Transition.CONFIGURE)
        assert rig.status("reporter").failure == ""


class Unready(Component):
    """Cannot be configured, and gives a reason that no message can carry."""

    reason: Exception = ValueError(SURROGATE)

    def on_configure(self) -> None:
        raise self.reason


class UnreadyForUnknownReasons(Unready):
    """Cannot be configured, and gives no reason."""

    reason = Speechless()


@pytest.mark.parametrize(
    ("cls", "failure"),
    [
        (Unready, "on_configure: ValueError: no file caf\\udce9"),
        (UnreadyForUnknownReasons, "on_configure: Speechless"),
    ],
)
def test_a_hook_that_raises_with_any_text_leaves_its_component_on_the_bus(cls: type[Unready], failure: str) -> None:
    with Rig() as rig:
        rig.add(cls, "unready")
        assert rig.state("unready") is State.UNCONFIGURED
        assert rig.status("unready").failure == failure
        assert len(rig.take_faults()) == 2
