"""Running processes publish their qualities; what is late, silent or not there is unknown, and is said."""

from __future__ import annotations

import json
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from regraft.bus_schema.messages.management.system import SystemMeasurements
from regraft.bus_schema.messages.protocol.control import ParameterValues
from regraft.client import TopicSample
from regraft.client.qualities import QualityNow, qualities_now
from tests.cli.app import whole
from tests.support.systems import System
from tests.support.waiting import wait_for, wait_until

pytestmark = pytest.mark.slow


def regraft(*arguments: str) -> Result:
    """Run a command in this process."""
    return CliRunner().invoke(whole(), list(arguments))


def now(system: System) -> dict[str, QualityNow]:
    """Return the qualities as a client sees them."""
    specs = {spec.name: spec for spec in system.client.host_view("local").specs}
    return {f"{each.component}.{each.quality}": each for each in qualities_now(system.client, specs, 2.0)}


def when(system: System, name: str, why: str) -> QualityNow:
    """Return a quality once it is known, or unknown for that reason."""

    def found() -> QualityNow | None:
        seen = now(system)[name]
        return seen if (seen.value is not None if not why else why in seen.why) else None

    return wait_for(found, f"{name}: {why or 'known'}")


def test_a_running_component_publishes_what_it_measures(system: System) -> None:
    published: list[TopicSample] = []
    with system.client.measurements("gauge", published.append):
        wait_until(lambda: len(published) >= 2, "two measurements")
    first, second = (sample.message for sample in published[:2])
    assert (first.component, first.values, first.unknown) == ("gauge", {"level": 0.5}, {})
    assert second.stamp > first.stamp


def test_a_client_sees_values_with_their_declaration_or_why_they_are_unknown(system: System) -> None:
    known = when(system, "gauge.level", "")
    assert (known.value, known.unit, known.better.value, known.maximum) == (0.5, "m", "higher", 1.0)
    assert when(system, "broken.level", "raised").why == "evaluate raised RuntimeError: the gauge is broken"
    assert when(system, "asleep.level", "inactive").value is None
    assert "plain" not in {each.component for each in now(system).values()}


def test_components_read_what_others_measure_as_a_topic(system: System) -> None:
    read: list[SystemMeasurements] = []
    system.client.topic("system/measurements", SystemMeasurements, lambda sample: read.append(sample.message))

    def level(component: str) -> float | str | None:
        found = read[-1].of(component) if read else None
        return None if found is None else found.values.get("level", found.unknown.get("level"))

    wait_until(lambda: level("gauge") == 0.5, "the gauge to be read")
    wait_until(lambda: level("broken") == "evaluate raised RuntimeError: the gauge is broken", "the broken one")
    assert read[-1].of("asleep") is None


def test_silence_is_unknown_and_a_fault_of_its_own_until_it_is_over(system: System) -> None:
    when(system, "busy.level", "")
    system.client.control("busy", "parameters", ParameterValues({"busy": 2.0}, 0))
    assert "late: measured every 0.05 s" in when(system, "busy.level", "late").why
    wait_until(lambda: system.said("quality.silent", "busy"), "the host reports silence")
    (event,) = system.said("quality.silent", "busy")
    assert "its class does every 0.05 s" in event.text
    wait_until(lambda: system.said("quality.heard", "busy"), "the host reports the end of silence")
    when(system, "busy.level", "")


def test_the_list_has_values_and_reasons(system: System) -> None:
    when(system, "gauge.level", "")
    rows = {row.split()[0]: row for row in regraft("quality", "list").stdout.splitlines()}
    assert rows["gauge.level"].split() == ["gauge.level", "0.5", "m", "0..1", "higher"]
    assert "the component is inactive" in rows["asleep.level"]
    (line,) = json.loads(regraft("quality", "list", "gauge", "--json").stdout)["qualities"]
    assert (line["quality"], line["value"], line["better"], line["functional"]) == ("level", 0.5, "higher", True)


def test_echo_prints_each_measurement(system: System) -> None:
    shown = regraft("quality", "echo", "gauge", "--once").stdout.splitlines()
    assert shown[0].endswith("s, gauge")
    assert shown[1:] == ["  level: 0.5 m"]
    documents: list[Any] = [
        json.loads(line) for line in regraft("quality", "echo", "broken", "--count", "2", "--json").stdout.splitlines()
    ]
    assert [each["unknown"] for each in documents] == [
        {"level": "evaluate raised RuntimeError: the gauge is broken"}
    ] * 2


@pytest.mark.usefixtures("simulated")
def test_hz_tells_the_rate_of_the_class() -> None:
    rates = json.loads(regraft("quality", "hz", "gauge", "--count", "3", "--json").stdout)
    assert rates["count"] == 3
    assert rates["stamp_hz"] == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("command", "code", "problem"),
    [
        (("echo", "gage"), 2, "there is no component 'gage'; did you mean 'gauge'?"),
        (("hz", "gage"), 2, "there is no component 'gage'; did you mean 'gauge'?"),
        (("list", "gage"), 2, "there is no component 'gage'; did you mean 'gauge'?"),
        (("echo", "plain"), 2, "plain measures no qualities; those that do: asleep, broken, busy, gauge"),
        (("echo", "gauge", "--count", "0"), 2, "--count"),
        (("list", "--robot", "frog"), 2, "frog"),
        (("echo", "asleep", "--once", "--for", "0.2"), 1, "asleep has published no qualities within 0.2 s"),
    ],
)
def test_what_cannot_be_shown_is_refused_with_the_nearest_name(
    system: System, command: tuple[str, ...], code: int, problem: str
) -> None:
    done = regraft("quality", *command)
    assert done.exit_code == code
    assert problem in done.stderr
    if command[0] == "echo" and command[1] == "asleep":
        assert "asleep is inactive: it measures nothing now; waiting" in done.stderr
