"""An adaptation is confirmed by anything measured: qualities, states, expressions; what broke is in its report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from regraft import Component
from regraft.bus.memory_bus import MemoryHub
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.errors import BadMessage
from regraft.bus_schema.messages.management.manager import UndoAdaptation
from regraft.bus_schema.model.adaptation import (
    AdaptationReport,
    AdaptationRequest,
    ChangeState,
    Outcome,
    SetParameters,
    StepState,
)
from regraft.bus_schema.model.architecture import Architecture, TopicSpec
from regraft.bus_schema.model.lifecycle import State, Transition
from regraft.bus_schema.model.watched import Breach, BreachCode, Condition
from tests.adaptation.conditions import MALFORMED
from tests.adaptation.host_stub import HostStub
from tests.adaptation.parts import ADAPT, Ticker
from tests.adaptation.system import SYSTEM, System, small_architecture, spec_of, started
from tests.adaptation.watching.conftest import Looks
from tests.adaptation.watching.gauging import Gauge
from tests.support.waiting import PATIENCE, wait_until

LOUDER = SetParameters("listener", {"gain": 0.9})
LONG = 60.0


@pytest.fixture
def gauged(tmp_path: Path) -> Iterator[System]:
    """A small system with a gauge, and its manager."""
    small = small_architecture()
    with started(replace(small, components={**small.components, "gauge": spec_of("gauge", Gauge)}), tmp_path) as system:
        system.start_manager()
        wait_until(lambda: system.client.ask_measured("gauge").values)
        yield system


def _line(system: System, adaptation: str) -> AdaptationReport:
    return system.lines(id=adaptation).entries[0]


def _confirming(system: System, *changes: Any, **more: Any) -> AdaptationReport:
    pending = system.adapt(*changes, wait=False, **{"confirm": LONG, **more})
    wait_until(lambda: _line(system, pending.id).outcome is not Outcome.PENDING)
    line = _line(system, pending.id)
    assert line.outcome is Outcome.CONFIRMING, line
    return line


def _ended(system: System, adaptation: str) -> AdaptationReport:
    wait_until(lambda: _line(system, adaptation).outcome is not Outcome.CONFIRMING)
    return _line(system, adaptation)


def _post(system: System, name: str, **values: Any) -> None:
    """Have a component change by itself."""
    runtime = system.running[name].runtime
    runtime.post(lambda: runtime.parameters.values.update(values))


def _begins_to_wear(system: System, wears: float) -> None:
    runtime = system.running["gauge"].runtime

    def begin() -> None:
        assert isinstance(runtime.component, Gauge)
        runtime.component.on_activate()
        runtime.parameters.values.update(wears=wears)

    runtime.post(begin)


HOLDING = (
    Condition(quality="gauge.level", at_least=4.0),
    Condition(quality="gauge.level", within=(0.0, 5.0)),
    Condition(component="second", state=State.ACTIVE),
    Condition(component="scanner", state=State.INACTIVE),
    Condition(require="gauge.level <= gauge.shown and listener.gain > 0.5 and not scanner.active"),
)


def test_what_holds_is_applied(gauged: System) -> None:
    report = gauged.adapt(LOUDER, confirm=0.6, watch=HOLDING)
    assert (report.outcome, report.broken) == (Outcome.APPLIED, ()), report


def _fades(system: System) -> None:
    _post(system, "gauge", shown=1.0)


def _falls_silent(system: System) -> None:
    _post(system, "gauge", works=False)


def _hushes(system: System) -> None:
    _post(system, "listener", gain=0.1)


def _rests(system: System) -> None:
    runtime = system.running["second"].runtime
    runtime.post(lambda: runtime.lifecycle.perform(Transition.DEACTIVATE))


def _dies(system: System) -> None:
    system.running["second"].kill()
    system.host.ended("second")


LEVEL = Condition(quality="gauge.level", at_least=4.0, unknown_for=0.2)
LOUD = Condition(require="listener.gain > 0.5")
HEARD = Condition(require="listener.gain > 0.2")
KNOWN = Condition(require="gauge.level > 1.0", unknown_for=0.2)
SECOND = Condition(component="second", state=State.ACTIVE)


@pytest.mark.parametrize(
    ("condition", "break_it", "code", "about", "value", "text"),
    [
        (LEVEL, _fades, BreachCode.QUALITY_OUT_OF_BOUNDS, "gauge", 1.0, "gauge.level is 1 m, must be at least 4"),
        (LEVEL, _falls_silent, BreachCode.QUALITY_UNKNOWN, "gauge", None, "nan: must be finite, after 0."),
        (KNOWN, _falls_silent, BreachCode.EXPRESSION_UNKNOWN, "", None, "gauge.level is unknown: nan"),
        (HEARD, _hushes, BreachCode.EXPRESSION_FALSE, "", None, "must be true, but listener.gain is 0.1"),
        (SECOND, _rests, BreachCode.WRONG_STATE, "second", None, "second is inactive, must be active"),
        (SECOND, _dies, BreachCode.ENDED, "second", None, "second has ended: killed"),
    ],
)
def test_what_breaks_undoes_it_and_is_in_the_report_and_the_event(
    gauged: System,
    looks: Looks,
    condition: Condition,
    break_it: Any,
    code: BreachCode,
    about: str,
    value: float | None,
    text: str,
) -> None:
    system = gauged
    line = _confirming(system, SetParameters("fragile", {"level": 3}), LOUDER, watch=(condition,))
    wait_until(lambda: system.view("listener").parameters["gain"] == 0.9)
    looks.before_the_next(partial(break_it, system))
    ended = _ended(system, line.id)
    assert ended.outcome is Outcome.ROLLED_BACK, ended
    (broken,) = ended.broken
    assert (broken.code, broken.watch, broken.component, broken.value) == (code, 0, about, value), broken
    assert text in broken.text
    assert ended.error == f"not confirmed: {broken.text}"
    assert [step.state for step in ended.steps] == [StepState.UNDONE] * 2
    assert system.view("fragile").parameters["level"] == 0
    wait_until(lambda: any(event.kind == "adaptation.rolled_back" for event in system.events))
    (told,) = [event for event in system.events if event.kind == "adaptation.rolled_back"]
    assert [codec.from_plain(one, Breach) for one in told.details["broken"]] == [broken]


def test_the_asker_is_told_what_broke(gauged: System) -> None:
    _begins_to_wear(gauged, 2.0)
    report = gauged.adapt(LOUDER, confirm=LONG, watch=(Condition(quality="gauge.level", at_least=1.0),))
    assert report.outcome is Outcome.ROLLED_BACK
    assert [breach.subject for breach in report.broken] == ["gauge.level"]


def test_what_was_broken_before_has_until_the_end(gauged: System) -> None:
    raised = Condition(quality="gauge.level", at_least=8.0)
    report = gauged.adapt(LOUDER, confirm=0.5, watch=(raised,))
    assert report.outcome is Outcome.ROLLED_BACK
    assert "was broken before, and still is" in report.error
    assert gauged.adapt(SetParameters("gauge", {"shown": 9.0}), confirm=0.6, watch=(raised,)).outcome is Outcome.APPLIED


def test_what_is_never_known_is_not_confirmed_however_patient(gauged: System) -> None:
    _falls_silent(gauged)
    patient = Condition(quality="gauge.level", at_least=4.0, unknown_for=1000.0)
    report = gauged.adapt(LOUDER, confirm=0.5, watch=(patient,))
    assert (report.outcome, report.broken[0].code) == (Outcome.ROLLED_BACK, BreachCode.QUALITY_UNKNOWN)


def test_what_was_measured_before_the_adaptation_says_nothing(gauged: System) -> None:
    gone = Condition(component="gauge", state=State.INACTIVE)
    rest = ChangeState("gauge", Transition.DEACTIVATE)
    assert gauged.adapt(rest, confirm=0.5, watch=(gone,)).outcome is Outcome.APPLIED
    back = ChangeState("gauge", Transition.ACTIVATE)
    assert gauged.adapt(back, confirm=0.6, watch=(LEVEL,)).outcome is Outcome.APPLIED


def test_an_undo_is_confirmed_too(gauged: System) -> None:
    applied = gauged.adapt(SetParameters("gauge", {"shown": 9.0}))
    request = UndoAdaptation(applied.id, confirm=0.6, watch=(Condition(quality="gauge.level", at_least=8.0),))
    report = gauged.client.call("adaptation_manager/undo", request, AdaptationReport, PATIENCE)
    assert (report.outcome, report.broken[0].value) == (Outcome.ROLLED_BACK, 5.0)
    assert gauged.view("gauge").parameters["shown"] == 9.0


@pytest.mark.parametrize(
    ("condition", "field", "problem"),
    [
        (Condition(quality="gauges.level", at_least=1.0), "quality", "did you mean 'gauge'?"),
        (Condition(quality="gauge.levle", at_least=1.0), "quality", "did you mean 'level'?"),
        (Condition(quality="gauge.guess", at_least=1.0), "quality", "gauge only estimates 'guess': it measures level"),
        (Condition(quality="talker.rate", at_least=1.0), "quality", "measures no quality 'rate'; it measures none"),
        (Condition(quality="gauge.level", at_least=11.0), "quality", "can never be at least 11: gauge.level has"),
        (Condition(component="secnd", state=State.ACTIVE), "component", "did you mean 'second'?"),
        (Condition(require="listener.gian > 0.5"), "require", "did you mean 'gain'?"),
        (Condition(require="listner.gain > 0.5"), "require", "did you mean 'listener'?"),
        (Condition(require="gauge.level"), "require", "gauge.level is a number, must be true or false, such as: gauge"),
        (Condition(require="not listener.gain"), "require", "listener.gain is a number, must be true or false"),
    ],
)
def test_what_cannot_be_watched_is_refused_and_nothing_is_touched(
    gauged: System, condition: Condition, field: str, problem: str
) -> None:
    before = gauged.views()
    report = gauged.adapt(LOUDER, confirm=1.0, watch=(SECOND, condition))
    assert report.outcome is Outcome.REJECTED
    (violation,) = report.violations
    assert violation.field == f"watch.1.{field}"
    assert problem in violation.problem
    assert gauged.views() == before


def test_a_time_that_is_shorter_than_a_period_is_refused(gauged: System) -> None:
    report = gauged.adapt(LOUDER, confirm=0.01, watch=(LEVEL,))
    assert "measures its qualities every 0.05 s, 'confirm' is 0.01 s" in report.violations[0].problem


@pytest.mark.parametrize(("plain", "where", "problem"), MALFORMED)
def test_a_condition_that_means_nothing_is_refused_by_field(plain: Any, where: str, problem: str) -> None:
    with pytest.raises(BadMessage) as caught:
        codec.from_plain({"changes": [], "confirm": 1, "watch": [plain]}, AdaptationRequest)
    assert ".".join(caught.value.where) == ".".join(filter(None, ("watch.0", where)))
    assert problem in caught.value.why


# --- under simulated time ---


class Asker(Component):
    """Adapts a gauge at certain times, and has it confirmed by what it measures."""

    def on_activate(self) -> None:
        """Begin to adapt."""
        self.reports: list[AdaptationReport] = []
        self.kit.spawn(self.adapt(), "adapting")

    async def adapt(self) -> None:
        """Have it show more each time; it wears, so that not every time holds."""
        for shown, least in ((9.0, 2.0), (9.5, 7.0), (8.0, 1.0)):
            await self.kit.sleep(0.4)
            conditions = (
                Condition(quality="gauge.level", at_least=least),
                Condition(require="gauge.level <= gauge.shown and gauge.active"),
            )
            request = AdaptationRequest((SetParameters("gauge", {"shown": shown}),), confirm=1.0, watch=conditions)
            self.reports.append(await self.kit.call(ADAPT, request, AdaptationReport, timeout=PATIENCE))


def _run(folder: Path) -> list[Any]:
    folder.mkdir()
    specs = [
        spec_of("ticker", Ticker, parameters={"speed": "max"}),
        spec_of("gauge", Gauge, parameters={"wears": 1.5}),
        spec_of("asker", Asker),
    ]
    topics = {name: TopicSpec(name, "regraft/Twist") for name in ("count", "echo")}
    architecture = Architecture(SYSTEM, 1, True, {spec.name: spec for spec in specs}, topics)
    hub = MemoryHub()
    system = System(hub, architecture, HostStub(hub, architecture), folder / "journal.sqlite")
    try:
        system.start_manager()
        for name in ("gauge", "asker", "ticker"):
            system.start(name)
        asker = system.running["asker"].component
        wait_until(lambda: len(getattr(asker, "reports", ())) == 3)
        clock = system.client.clock()
        assert clock is not None
        assert clock.reproducible
        return [(r.outcome, r.tick, r.started, r.error, r.broken, r.phases[-1].duration) for r in asker.reports]
    finally:
        system.end()


def test_confirmation_by_qualities_is_the_same_in_every_run(tmp_path: Path) -> None:
    ends = _run(tmp_path / "one")
    assert [end[0] for end in ends] == [Outcome.APPLIED, Outcome.ROLLED_BACK, Outcome.APPLIED]
    assert ends[1][4][0].value < 7.0
    assert _run(tmp_path / "two") == ends
