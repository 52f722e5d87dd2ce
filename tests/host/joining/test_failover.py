"""The request to the manager when a host is lost."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import TypeVar

import pytest

from regraft import Component, service
from regraft.bus_schema.messages.management.manager import JournalPage, JournalRequest
from regraft.bus_schema.model.adaptation import ADAPT, JOURNAL, AdaptationReport, AdaptationRequest, Outcome
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
