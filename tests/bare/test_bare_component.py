"""A component written from docs/protocol.md alone takes part like any other, under the real clock."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from regraft.bus_schema.encoding import codec
from regraft.bus_schema.encoding.envelope import Envelope
from regraft.bus_schema.encoding.registry import type_of
from regraft.bus_schema.messages.protocol.control import (
    ComponentView,
    ControlCode,
    ParameterValues,
    Peer,
    Rewire,
    RewireStep,
    SetTransition,
    Snapshot,
    StateRequest,
    StateStep,
)
from regraft.bus_schema.messages.protocol.requests import Answer, Reply, Request, Verb
from regraft.bus_schema.messages.sensors import LightLevel
from regraft.bus_schema.model.description import Description
from regraft.bus_schema.model.lifecycle import State, Transition
from tests.support.waiting import PATIENCE, wait_for

from .kit_side import Asker, Lamp, Recorder
from .systems import ControlRefused, System

pytestmark = pytest.mark.slow

FROM_LAMP = {"light": "level"}


@pytest.fixture
def system() -> Iterator[System]:
    with System() as made:
        yield made


def numbers(system: System) -> list[float]:
    """Return the numbers of the levels that came back to the recorder."""
    return [stamp for stamp, _, _ in system.state_of("recorder")["echoes"]]


def consecutive(found: list[float]) -> bool:
    """Tell whether nothing was lost, doubled or out of order."""
    return found == [found[0] + i for i in range(len(found))]


def grown(system: System, beyond: int) -> list[float]:
    """Return the numbers once there are more than ``beyond``."""
    return wait_for(lambda: found if len(found := numbers(system)) > beyond else None, f"more than {beyond} echoes")


def test_it_shows_itself_alive_and_describes_itself(system: System) -> None:
    system.bare(revision=7)
    system.wait_for("active", "bare")
    assert system.keys.alive("bare", 1) in system.bus.present(system.keys.alive("*", "*"), 1.0)
    heard = len(system.statuses["bare"])
    wait_for(lambda: len(system.statuses["bare"]) > heard + 3, "heartbeats")
    status = system.statuses["bare"][-1]
    assert (status.state, status.revision, status.error) == (State.ACTIVE, 7, "")
    description = system.control("bare", "describe", None, Description)
    assert [(port.name, port.direction, port.type) for port in description.ports] == [
        ("light", "input", "regraft/LightLevel"),
        ("echo", "output", "regraft/LightLevel"),
        ("count", "output", "regraft/Vector3"),
    ]
    assert [offered.name for offered in description.services] == ["invert"]


def test_messages_of_the_kit_come_back_to_the_kit_complete_and_in_order(system: System) -> None:
    system.kit("recorder", Recorder)
    system.bare(connections=FROM_LAMP, parameters={"gain": 0.5})
    system.wait_for("active", "recorder", "bare")
    system.kit("lamp", Lamp)
    echoes = grown(system, 150)
    assert consecutive(echoes)
    recorded = system.state_of("recorder")
    assert all(darkness == stamp % 10 / 10 * 0.5 for stamp, darkness, _ in recorded["echoes"])
    counts = [count for count, _ in recorded["counts"]]
    assert counts == sorted(counts)
    assert counts[-1] > 0
    assert system.statuses["bare"][-1].lost == 0


def test_its_parameters_are_read_set_and_refused(system: System) -> None:
    system.bare(parameters={"gain": 0.25})
    assert system.control("bare", "parameters", None, ComponentView).parameters == {"gain": 0.25}
    set_to = ParameterValues({"gain": 0.75}, revision=4)
    view = system.control("bare", "parameters", set_to, ComponentView)
    assert (view.parameters, view.revision) == ({"gain": 0.75}, 4)
    for wrong in ({"gain": 2.0}, {"volume": 1}, {"gain": "loud"}):
        with pytest.raises(ControlRefused) as refused:
            system.control("bare", "parameters", ParameterValues(wrong), ComponentView)
        assert refused.value.error.code is ControlCode.REFUSED
    assert system.control("bare", "parameters", None, ComponentView).parameters == {"gain": 0.75}


def test_changes_come_only_from_the_current_term(system: System) -> None:
    system.bare(term=3)
    for term in (None, 2):
        with pytest.raises(ControlRefused) as refused:
            system.control("bare", "parameters", ParameterValues({"gain": 0.5}, term), ComponentView)
        assert refused.value.error.code is ControlCode.FENCED
    assert (
        system.control("bare", "parameters", ParameterValues({"gain": 0.5}, 5), ComponentView).parameters["gain"] == 0.5
    )
    with pytest.raises(ControlRefused):
        system.control("bare", "transition", SetTransition(Transition.DEACTIVATE, 4), ComponentView)


def test_it_goes_through_the_lifecycle_and_refuses_what_is_not_legal(system: System) -> None:
    system.bare(state=State.UNCONFIGURED)
    for transition, state in (
        (Transition.CONFIGURE, State.INACTIVE),
        (Transition.ACTIVATE, State.ACTIVE),
        (Transition.DEACTIVATE, State.INACTIVE),
        (Transition.CLEANUP, State.UNCONFIGURED),
    ):
        assert system.control("bare", "transition", SetTransition(transition), ComponentView).state is state
    with pytest.raises(ControlRefused) as refused:
        system.control("bare", "transition", SetTransition(Transition.ACTIVATE), ComponentView)
    assert refused.value.error.code is ControlCode.FAILED
    for payload in (b"\xc1", codec.pack_plain({"transition": "fly"}), codec.pack_plain([])):
        (answer,) = system.bus.query(system.keys.control("bare", 1, "transition"), payload, PATIENCE)
        assert answer.error


def test_while_inactive_it_neither_reads_nor_writes(system: System) -> None:
    system.kit("recorder", Recorder)
    system.bare(connections=FROM_LAMP)
    system.wait_for("active", "recorder", "bare")
    system.kit("lamp", Lamp)
    grown(system, 10)
    system.control("bare", "transition", SetTransition(Transition.DEACTIVATE), ComponentView)
    handled = system.state_of("bare")["handled"]
    told = system.state_of("lamp")["told"]
    wait_for(lambda: system.state_of("lamp")["told"] > told + 30, "the lamp goes on")
    assert system.state_of("bare")["handled"] == handled
    before = len(numbers(system))
    assert before == handled
    system.control("bare", "transition", SetTransition(Transition.ACTIVATE), ComponentView)
    after = grown(system, before + 20)
    assert max(b - a for a, b in pairwise(after)) > 30
    assert system.statuses["bare"][-1].lost == 0


def test_a_component_of_the_kit_calls_its_service(system: System) -> None:
    system.bare()
    system.wait_for("active", "bare")
    system.kit("asker", Asker)
    answers = wait_for(lambda: a if len(a := system.state_of("asker")["answers"]) > 3 else None, "answers")
    assert all(darkness == 0.75 for _, _, darkness in answers)


class Client:
    """Puts requests as docs/protocol.md has it, number by number, and collects the replies."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.replies: list[Reply] = []
        system.bus.subscribe(system.keys.reply("**", "client-1"), self._take)
        self._publisher = system.bus.publisher(system.keys.request("invert"), type_of(Request).encoding, reliable=True)
        self._sequence = 0
        wait_for(lambda: self._publisher.matched, "somebody serves")

    def _take(self, item: Any) -> None:
        sample = self.system.bus.open_sample(item)
        if sample is not None:
            self.replies.append(codec.decode(sample.payload, Reply))

    def put(self, request: Request) -> Reply:
        self._sequence += 1
        before = len(self.replies)
        self._publisher.put(codec.encode(request), Envelope("client-1", 1, 1, self._sequence, 0).to_bytes())
        return wait_for(lambda: self.replies[before] if len(self.replies) > before else None, "a reply")


def test_a_request_asked_again_is_answered_again_not_done_again(system: System) -> None:
    system.bare()
    system.wait_for("active", "bare")
    client = Client(system)
    request = Request("client-1", 1, Verb.CALL, codec.to_plain(LightLevel(1.0, 0.25)))
    first = client.put(request)
    assert (first.answer, first.body["darkness"]) == (Answer.RESULT, 0.75)
    different = Request("client-1", 1, Verb.CALL, codec.to_plain(LightLevel(1.0, 0.5)))
    assert client.put(different) == first
    assert client.put(Request("client-1", 1, Verb.RESULT)) == first


def test_requests_that_do_not_fit_are_refused_with_a_reason(system: System) -> None:
    system.bare(state=State.INACTIVE)
    system.wait_for("inactive", "bare")
    client = Client(system)
    level = codec.to_plain(LightLevel(1.0, 0.25))
    assert "inactive" in client.put(Request("client-1", 1, Verb.CALL, level)).error
    system.control("bare", "transition", SetTransition(Transition.ACTIVATE), ComponentView)
    for number, request in enumerate(
        (
            Request("client-1", 2, Verb.GOAL, level),
            Request("client-1", 3, Verb.CALL, {"colour": "red"}),
            Request("client-1", 4, Verb.RESULT),
        ),
        start=2,
    ):
        reply = client.put(request)
        assert (reply.number, reply.answer) == (number, Answer.REFUSED)
        assert reply.error


def rewire(system: System, component: str, step: RewireStep, port: str, topic: str, **more: Any) -> dict[str, Any]:
    """Ask one step of rewiring and return the detail of the answer."""
    message = Rewire(step, port, topic, **more)
    return system.control(component, "connections", message, ComponentView).detail


def wired(system: System, reader: str, port: str, topic: str, writer: str) -> None:
    """Have markers put until the reader has seen one."""

    def marked() -> bool:
        rewire(system, writer, RewireStep.MARK, "", topic)
        return not rewire(system, reader, RewireStep.AWAIT, port, topic, peers=(Peer(writer, 1),))["missing"]

    wait_for(marked, f"{reader} sees a marker of {writer} on {topic}")


def test_its_input_moves_between_two_busy_topics_without_loss(system: System) -> None:
    system.kit("recorder", Recorder)
    system.bare(connections={"light": "one"})
    system.wait_for("active", "recorder", "bare")
    system.kit("first", Lamp, connections={"level": "one"})
    system.kit("second", Lamp, connections={"level": "two"}, parameters={"first": 1_000_001})
    system.wait_for("active", "first", "second")
    grown(system, 20)
    rewire(system, "bare", RewireStep.OPEN, "light", "two")
    wired(system, "bare", "light", "two", "second")
    cut = rewire(system, "first", RewireStep.MARK, "", "one")["sequence"]
    before = len(numbers(system))
    assert rewire(system, "bare", RewireStep.SWITCH, "light", "two", cuts={"first": cut})["complete"]
    assert system.control("bare", "connections", None, ComponentView).connections["light"] == "two"
    echoes = grown(system, before + 50)
    breaks = [i for i in range(1, len(echoes)) if echoes[i] != echoes[i - 1] + 1]
    assert len(breaks) == 1
    assert consecutive(echoes[: breaks[0]])
    assert consecutive(echoes[breaks[0] :])
    assert echoes[breaks[0] - 1] >= cut


def test_its_output_moves_to_another_topic_without_loss(system: System) -> None:
    system.kit("recorder", Recorder)
    system.bare(connections=FROM_LAMP)
    system.wait_for("active", "recorder", "bare")
    system.kit("lamp", Lamp)
    grown(system, 20)
    rewire(system, "recorder", RewireStep.OPEN, "echo", "elsewhere")
    rewire(system, "bare", RewireStep.OPEN, "echo", "elsewhere")
    wired(system, "recorder", "echo", "elsewhere", "bare")
    cut = rewire(system, "bare", RewireStep.SWITCH, "echo", "elsewhere")["cut"]
    assert rewire(system, "recorder", RewireStep.SWITCH, "echo", "elsewhere", cuts={"bare": cut})["complete"]
    assert consecutive(grown(system, cut + 50))


def test_a_move_can_be_abandoned_and_a_wrong_step_is_refused(system: System) -> None:
    system.kit("recorder", Recorder)
    system.bare(connections=FROM_LAMP)
    system.wait_for("active", "recorder", "bare")
    system.kit("lamp", Lamp)
    for port in ("light", "echo"):
        rewire(system, "bare", RewireStep.OPEN, port, "elsewhere")
        rewire(system, "bare", RewireStep.ABANDON, port, "elsewhere")
        with pytest.raises(ControlRefused) as refused:
            rewire(system, "bare", RewireStep.SWITCH, port, "elsewhere")
        assert refused.value.error.code is ControlCode.REFUSED
    for port, topic in (("nothing", "elsewhere"), ("light", "no topic"), ("light", "level")):
        with pytest.raises(ControlRefused):
            rewire(system, "bare", RewireStep.OPEN, port, topic)
    assert consecutive(grown(system, 30))


def test_its_state_goes_to_a_successor_by_query_and_by_checkpoint(system: System, tmp_path: Path) -> None:
    system.bare()
    system.wait_for("active", "bare")
    given = StateRequest(StateStep.RESTORE, {"handled": 42}, 1)
    system.control("bare", "state", given, ComponentView)
    snapshot = system.control("bare", "state", None, Snapshot)
    assert (snapshot.state, snapshot.version) == ({"handled": 42}, 1)
    with pytest.raises(ControlRefused):
        system.control("bare", "state", StateRequest(StateStep.RESTORE, {"handled": 1}, 2), ComponentView)
    kept = tmp_path / "bare.checkpoint"
    kept.write_bytes(codec.encode(snapshot))
    system.bare("successor", str(kept))
    system.wait_for("active", "successor")
    assert system.state_of("successor") == {"handled": 42}


def test_a_message_that_does_not_fit_is_counted_and_does_no_harm(system: System) -> None:
    system.bare()
    system.wait_for("active", "bare")
    publisher = system.bus.publisher(system.keys.topic("light"), type_of(LightLevel).encoding, reliable=True)
    wait_for(lambda: publisher.matched, "the bare component reads")
    publisher.put(b"\xc1", Envelope("stranger", 1, 1, 1, 0).to_bytes())
    publisher.put(codec.encode(LightLevel(1.0, 0.5)), b"no envelope")
    publisher.put(codec.encode(LightLevel(1.0, 0.5)), Envelope("stranger", 1, 1, 2, 0).to_bytes())
    wait_for(lambda: system.statuses["bare"][-1].refused == 2, "both refused")
    assert system.state_of("bare") == {"handled": 1}


def test_asked_to_end_it_finalizes_and_leaves(system: System) -> None:
    system.bare()
    system.wait_for("active", "bare")
    system.processes["bare"].terminate()
    assert system.processes["bare"].wait(PATIENCE) == 0
    system.wait_for("finalized", "bare")
    wait_for(lambda: not system.bus.present(system.keys.alive("bare", "*"), 1.0), "its token is gone")
