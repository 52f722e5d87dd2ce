"""A host that has just joined is asked again for a moment: its answers are not known everywhere yet."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import pytest

from regraft import Component, service
from regraft.adaptation_manager.targets import host_client
from regraft.adaptation_manager.targets.component_client import NoAnswer
from regraft.adaptation_manager.targets.host_client import Hosts
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.registry import message
from regraft.bus_schema.messages.protocol.host import DescribedComponent
from regraft.bus_schema.model.architecture import ComponentSpec
from regraft.testing import Rig


@message("just_joined_tests/Text")
@dataclass(frozen=True, slots=True)
class Text:
    """Some text."""

    text: str = ""


class Asker(Component):
    """Asks the host edge what a component would be."""

    @service("ask")
    async def ask(self, _: Text) -> Text:
        hosts = Hosts(self.kit, lambda: 1.0)
        try:
            return Text((await hosts.describe(ComponentSpec("lamp", "lamps:Lamp", host="edge"))).spec.name)
        except NoAnswer as error:
            return Text(str(error))


def test_a_host_whose_answers_are_not_known_yet_is_asked_again() -> None:
    with Rig() as rig:
        rig.add(Asker, "asker")

        def answer(query: Any) -> None:
            query.reply(codec.encode(DescribedComponent(ComponentSpec("lamp"))))

        threading.Timer(0.1, rig.bus.serve, ("rig/host/edge/describe", answer)).start()
        assert rig.call("ask", Text(), Text) == Text("lamp")


def test_a_host_that_never_answers_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_client, "JUST_JOINED", 0.1)
    with Rig() as rig:
        rig.add(Asker, "asker")
        assert rig.call("ask", Text(), Text) == Text("host 'edge': describe: no answer")
