"""The bare component as a member of simulated time: section "Simulated time" of docs/protocol.md."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import zenoh

from .bare_wire import PLAIN_ENCODING, Bad, Plain, Stream, packed, unpacked

if TYPE_CHECKING:
    from .bare_component import BareComponent

JOIN_INTERVAL = 0.5
IDLE_JOIN_TIMEOUT = 2.0
SLOT_REQUEST_INTERVAL = 0.2
INPUTS_TIMEOUT = 5.0


class Member:
    """Works when it is given a step, and acknowledges."""

    def __init__(self, component: BareComponent) -> None:
        self._component = component
        self._step: Plain | None = None
        self._last_ack: Plain | None = None
        self._begun = 0
        self._told: tuple[dict[str, bool], set[str]] | None = None
        self._started = False
        self._configured_to = ""
        self._next_join = 0.0
        self._next_slot_request = 0.0
        self._publishers: dict[str, Any] = {}
        component.marker_listeners.append(self._saw_marker)

    def run(self) -> None:
        """Join, and work until the component is finalized."""
        component = self._component
        component.declare()
        if component.assignment.get("state", "active") in ("inactive", "active"):
            component.reach("inactive")
        self._configured_to = component.state
        step_key = component.key("clock", "step", component.name)
        component.takers[step_key] = self._take_step
        declared: list[Any] = [
            component.session.declare_subscriber(step_key, component.inbox.put),
            component.session.liveliness().declare_subscriber(
                component.key("clock", "alive", "*"), self._coordinator, history=True
            ),
        ]
        while component.state != "finalized":
            self._pump()
            if self._step is not None:
                step, self._step = self._step, None
                self._perform(step)
            self._join_if_due()
            self._want_if_due()
        for subscription in declared:
            subscription.undeclare()
        component.leave()

    def _put(self, part: str, type_name: str, message: Plain) -> None:
        key = self._component.key("clock", part)
        if key not in self._publishers:
            self._publishers[key] = self._component.session.declare_publisher(
                key,
                encoding=PLAIN_ENCODING.format(type_name),
                congestion_control=zenoh.CongestionControl.BLOCK,
            )
        self._publishers[key].put(packed(message))

    @property
    def _me(self) -> Plain:
        return {"member": self._component.name, "incarnation": self._component.incarnation}

    # --- asking ---

    def _coordinator(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.PUT:
            self._component.inbox.put(self._join_at_once)

    def _join_at_once(self) -> None:
        self._next_join = 0.0

    def _join_if_due(self) -> None:
        if time.monotonic() < self._next_join:
            return
        self._next_join = time.monotonic() + (IDLE_JOIN_TIMEOUT if self._last_ack else JOIN_INTERVAL)
        join = {
            **self._me,
            "epoch": self._component.epoch,
            "wiring": self._wiring(),
            "next_wake": self._next_wake(),
            "time": self._component.time,
        }
        self._put("join", "regraft/Join", join)

    def _wiring(self) -> Plain:
        component, rewiring = self._component, self._component.rewiring
        inputs = {component.request_key: True}
        if not rewiring.lets_pass:
            inputs |= {key: True for key in (rewiring.keys.get("light"), rewiring.move) if key}
        return {
            "inputs": inputs,
            "outputs": {key: writer.sequence for key, writer in component.writers.items()},
        }

    def _next_wake(self) -> int | None:
        return self._component.count_due if self._started else 0

    def _saw_marker(self, key: str, source: str, stream: Stream) -> None:
        seen = {**self._me, "key": key, "source": source, "sequence": stream.handled or 0}
        self._put("marker_ack", "regraft/MarkerAck", seen)

    def _want_if_due(self) -> None:
        if time.monotonic() < self._next_slot_request:
            return
        pairs = self._component.streams.by_pair.items()
        outside = sorted({source for (_, source), stream in pairs if stream.waiting and not stream.wired})
        if outside:
            self._next_slot_request = time.monotonic() + SLOT_REQUEST_INTERVAL
            self._put("slot_request", "regraft/SlotRequest", {**self._me, "outside": outside})

    # --- steps ---

    def _take_step(self, sample: zenoh.Sample) -> None:
        step = unpacked(sample.payload.to_bytes())
        if not {"incarnation", "number", "kind", "round", "time"} <= step.keys():
            raise Bad("is no step")
        if step["incarnation"] != self._component.incarnation:
            return
        if self._last_ack is not None and step["number"] == self._last_ack["number"]:
            self._put("ack", "regraft/Ack", self._last_ack)
        elif step["number"] != self._begun:
            self._step = step

    def _perform(self, step: Plain) -> None:
        component = self._component
        self._begun = step["number"]
        self._next_join = time.monotonic() + IDLE_JOIN_TIMEOUT
        error = ""
        if step["kind"] == "welcome":
            component.time = max(component.time, step["time"])
            component.streams.restart()
            component.advanced.clear()
            self._told = None
        elif step["kind"] == "mark":
            for key in step.get("marks", []):
                if key in component.writers:
                    component.writers[key].mark(component.now())
        elif step["kind"] == "step":
            error = self._work(step)
        elif step["kind"] == "slot":
            self._release_outside(step.get("outside", []))
        self._acknowledge(step["number"], error)

    def _work(self, step: Plain) -> str:
        component = self._component
        component.streams.restart(set(step.get("gone", [])))
        frontier: dict[str, dict[str, int]] = step.get("frontier", {})
        error = self._wait_for(frontier)
        component.time = max(component.time, step["time"])
        for key in sorted(frontier):
            for source in sorted(frontier[key]):
                component.ready += self._stream(key, source).release(frontier[key][source])
        if not self._started:
            self._started = True
            if component.state == self._configured_to:
                component.reach(component.assignment.get("state", "active"))
        component.work()
        if step["round"] == 0:
            component.fire()
        return error

    def _stream(self, key: str, source: str) -> Stream:
        return self._component.streams.by_pair.setdefault((key, source), Stream())

    def _wait_for(self, frontier: dict[str, dict[str, int]]) -> str:
        deadline = time.monotonic() + INPUTS_TIMEOUT
        wanted = [(key, source, number) for key, sources in frontier.items() for source, number in sources.items()]
        while not all(self._stream(key, source).reaches(number) for key, source, number in wanted):
            if time.monotonic() > deadline:
                return "some of the messages that were to be handled have not come"
            self._pump()
        return ""

    def _release_outside(self, sources: list[str]) -> None:
        for pair in sorted(self._component.streams.by_pair):
            if pair[1] in sources:
                self._component.ready += self._component.streams.by_pair[pair].release_all()
        self._component.work()

    def _acknowledge(self, number: int, error: str) -> None:
        component = self._component
        wiring = self._wiring()
        names = (wiring["inputs"], set(wiring["outputs"]))
        ack = {
            **self._me,
            "number": number,
            "published": dict(component.advanced),
            "next_wake": self._next_wake(),
            "wiring": wiring if names != self._told else None,
            "error": error,
        }
        component.advanced.clear()
        self._told, self._last_ack = names, ack
        self._put("ack", "regraft/Ack", ack)

    def _pump(self) -> None:
        """Take what arrives, up to the next step; answer control queries; keep the heartbeat."""
        component = self._component
        component.rewiring.answer_parked()
        component.pump(min(component.beat_if_due(), 0.05))
