"""The request to the manager when a host is lost."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import TypeVar

import pytest

from regraft import Component, service
from regraft.bus_schema.messages.management.manager import CancelAdaptation, JournalPage, JournalRequest
from regraft.bus_schema.model.adaptation import (
    ADAPT,
    CANCEL,
    JOURNAL,
    AdaptationReport,
    AdaptationRequest,
    Outcome,
)
from regraft.client import Client
from regraft.host.joining import failover
from regraft.host.joining.failover import Failover
from tests.support.stepped.site import Site
from tests.support.waiting import PATIENCE, wait_until

A = TypeVar("A")


class SlowManager(Component):
    """Carries nothing out until it may."""

    def on_configure(self) -> None:
        self.may = threading.Event()
        self.keys: list[str] = []
        self.answers_journal = True

    @service(ADAPT)
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        self.keys.append(request.key)
        while not self.may.is_set():
            await self.kit.sleep(0.01)
        return AdaptationReport("1", Outcome.APPLIED_STATE_LOST, request, 1, 2, self.kit.now())

    @service(JOURNAL)
    async def journal(self, request: JournalRequest) -> JournalPage:
        while not self.answers_journal:
            await self.kit.sleep(0.01)
        return JournalPage(())


class InterruptedManager(Component):
    """Does not answer the first question, as one that is killed; has rolled it back when it is asked again."""

    def on_configure(self) -> None:
        self.keys: list[str] = []

    @service(ADAPT)
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        self.keys.append(request.key)
        if len(self.keys) == 1:
            await self.kit.sleep(PATIENCE)
        outcome = Outcome.ROLLED_BACK if request.key == self.keys[0] else Outcome.APPLIED_STATE_LOST
        return AdaptationReport("1", outcome, request, 1, 2, self.kit.now(), error="interrupted")

    @service(JOURNAL)
    async def journal(self, request: JournalRequest) -> JournalPage:
        return JournalPage(())


class BusyManager(Component):
    """Keeps everything waiting for its turn, until it is cancelled."""

    def on_configure(self) -> None:
        self.asked: list[AdaptationRequest] = []
        self.cancelled = threading.Event()
        self.has_begun = False

    def _report(self, outcome: Outcome) -> AdaptationReport:
        return AdaptationReport("7", outcome, self.asked[0], 1, 2, self.kit.now())

    @service(ADAPT)
    async def adapt(self, request: AdaptationRequest) -> AdaptationReport:
        self.asked.append(request)
        if not request.wait:
            return self._report(Outcome.PENDING)
        while not self.cancelled.is_set():
            await self.kit.sleep(0.01)
        return self._report(Outcome.CANCELLED)

    @service(JOURNAL)
    async def journal(self, request: JournalRequest) -> JournalPage:
        return JournalPage((self._report(Outcome.PENDING),) if self.has_begun else ())

    @service(CANCEL)
    async def cancel(self, wanted: CancelAdaptation) -> AdaptationReport:
        assert wanted.id == "7"
        self.cancelled.set()
        return self._report(Outcome.CANCELLED)


class PatientClient(Client):
    """Waits as long as need be for an answer to a question, but not for an adaptation."""

    def call(self, service: str, request: object, reply: type[A], timeout: float = 5.0, *, patient: bool = False) -> A:
        """Ask a service."""
        return super().call(service, request, reply, PATIENCE if service == JOURNAL else timeout, patient=patient)


@pytest.fixture
def site(monkeypatch: pytest.MonkeyPatch) -> Iterator[Site]:
    monkeypatch.setattr(failover, "ANSWER_TIMEOUT", 0.1)
    monkeypatch.setattr(failover, "KEEP_TRYING", 0.3)
    monkeypatch.setattr(failover, "RETRY_INTERVAL", 0.02)
    site = Site("memory")
    yield site
    site.close()


def begun(site: Site) -> tuple[SlowManager, list[str]]:
    """Have two components moved, by a manager that does not come to it; returns it, and what is said meanwhile."""
    manager, said = site.start(SlowManager, "adaptation_manager"), []
    Failover(site.session(), "site", lambda *told: said.append(told[0])).begin("edge", "local", ("camera", "radio"))
    wait_until(lambda: bool(manager.keys), "the manager to be asked")
    return manager, said


def test_a_manager_that_is_busy_is_waited_for_and_nothing_is_called_stranded(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(failover, "Client", PatientClient)
    manager, said = begun(site)
    asking = [thread for thread in threading.enumerate() if thread.name == "failover"]
    assert asking
    wait_until(lambda: len(manager.keys) >= 8, "it to be asked for longer than a silent manager is")
    assert said == []
    manager.may.set()
    wait_until(lambda: not any(thread.is_alive() for thread in asking), "the asking to end")
    assert said == []
    assert len(set(manager.keys)) == 1, "it is one adaptation, however often it is asked for"


def test_what_a_silent_manager_leaves_is_called_stranded(site: Site) -> None:
    manager, said = begun(site)
    manager.answers_journal = False
    wait_until(lambda: said == ["host.stranded"], "what is not started to be named", PATIENCE)
    manager.answers_journal = True
    manager.may.set()


def test_a_component_is_started_elsewhere_although_the_manager_was_killed_meanwhile(site: Site) -> None:
    manager, said = site.start(InterruptedManager, "adaptation_manager"), []
    Failover(site.session(), "site", lambda *told: said.append(told[0])).begin("edge", "local", ("camera",))
    asking = [thread for thread in threading.enumerate() if thread.name == "failover"]
    wait_until(lambda: not any(thread.is_alive() for thread in asking), "the asking to end")
    assert said == []
    assert len(set(manager.keys)) == 2, "what was rolled back is asked for as another adaptation"


def _waiting(site: Site) -> tuple[BusyManager, Failover, list[str]]:
    """Have two components moved, by a manager that has others to carry out first; returns all three."""
    manager, said = site.start(BusyManager, "adaptation_manager"), []
    rescue = Failover(site.session(), "site", lambda *told: said.append(told[0]))
    rescue.begin("edge", "local", ("camera", "radio"))
    wait_until(lambda: any(request.wait for request in manager.asked), "the end to be waited for")
    return manager, rescue, said


def test_what_waits_for_its_turn_is_withdrawn_when_the_host_is_back(site: Site) -> None:
    manager, rescue, said = _waiting(site)
    asking = [thread for thread in threading.enumerate() if thread.name == "failover"]
    rescue.withdraw("edge")
    wait_until(lambda: not any(thread.is_alive() for thread in asking), "the asking to end")
    assert manager.cancelled.is_set()
    assert {len(request.changes) for request in manager.asked} == {2}, "no component is tried alone"
    assert said == [], "nothing is stranded"


def test_what_is_under_way_is_not_withdrawn_when_the_host_is_back(site: Site) -> None:
    manager, rescue, said = _waiting(site)
    manager.has_begun = True
    rescue.withdraw("edge")
    wait_until(lambda: not any(thread.name == "withdrawal" for thread in threading.enumerate()), "the look at it")
    assert not manager.cancelled.is_set()
    assert said == []
    manager.cancelled.set()
