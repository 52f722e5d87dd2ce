"""The control queries of the bare component, and the rewiring of its ports, as docs/protocol.md has them."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import zenoh

from .bare_wire import Bad, Held, Plain, Stream, packed, unpacked

if TYPE_CHECKING:
    from .bare_component import BareComponent

AWAIT_AT_MOST = 0.1
TOPIC = re.compile(
    r"[A-Za-z0-9_][A-Za-z0-9_-]{0,63}(\.[A-Za-z0-9_][A-Za-z0-9_-]{0,63})?(/[A-Za-z0-9_][A-Za-z0-9_-]{0,63}){0,7}"
)
OUTPUTS = {"echo": "regraft/LightLevel", "count": "regraft/Vector3"}
INPUT = "light"


class Refused(Exception):
    """Why a control query did not do what it was asked."""

    def __init__(self, code: str, problem: str) -> None:
        self.code = code
        super().__init__(problem)


@dataclass
class Parked:
    """A step whose answer waits."""

    query: zenoh.Query
    ready: Callable[[], bool]
    finish: Callable[[], Plain]
    deadline: float


def _reply(query: Any, message: Plain, *, error: bool = False) -> None:
    if error:
        query.reply_err(packed(message))
    else:
        query.reply(query.key_expr, packed(message))
    query.drop()


class Rewiring:
    """Where the ports of one component are, where they are going, and what is asked of them."""

    def __init__(self, component: BareComponent) -> None:
        self._component = component
        self.keys: dict[str, str] = {}
        self.paused = True
        self.move = ""
        self._marks: dict[str, tuple[int, int]] = {}
        self._held: list[Held] = []
        self._seen: dict[tuple[str, str], int] = {}
        self._opened: dict[str, str] = {}
        self._parked: list[Parked] = []

    @property
    def lets_pass(self) -> bool:
        """Whether what arrives is let go by: nobody reads, and nobody is about to."""
        return self.paused and not self.move

    # --- ports ---

    def connect(self) -> None:
        """Connect every port to its assigned topic."""
        component = self._component
        for name in (INPUT, *OUTPUTS):
            self.keys[name] = component.key("topic", component.topic_of(name))
        component.subscribe(self.keys[INPUT])
        for name, type_name in OUTPUTS.items():
            component.writer(self.keys[name], type_name)

    def disconnect(self) -> None:
        """Take every port off the bus."""
        component = self._component
        for key in filter(None, (self.keys.get(INPUT), self.move)):
            component.unsubscribe(key)
        for name in OUTPUTS:
            component.close_writer(self.keys.get(name, ""))
        self.keys, self.move, self.paused = {}, "", True

    def pause(self, paused: bool) -> None:
        """Read no more for a while, or again."""
        self.paused = paused
        if self._component.stepped:
            self._component.streams.unwire(self.keys.get(INPUT, ""))

    def is_for_us(self, key: str, held: Plain) -> bool:
        """Tell whether a sample is to be handled now; one from the topic that we move to waits for the switch."""
        if self.move and key == self.move:
            self._held.append((key, held))
            return False
        return not self.paused and key == self.keys.get(INPUT)

    def saw_marker(self, key: str, source: str, stream: Stream) -> None:
        """Note a marker."""
        self._seen[key, source] = stream.incarnation
        if self.move and key == self.move:
            self._marks.setdefault(source, (stream.incarnation, stream.handled or 0))

    # --- control queries ---

    def answer(self, query: zenoh.Query) -> None:
        """Answer a query, now or when what it waits for has happened."""
        verb = str(query.key_expr).rsplit("/", 1)[-1]
        payload = query.payload.to_bytes() if query.payload is not None else b""
        verbs: dict[str, Callable[[Plain, zenoh.Query], Plain | None]] = {
            "describe": lambda _, __: self._description(),
            "transition": self._transition,
            "parameters": self._parameters,
            "connections": self._connections,
            "state": self._state,
        }
        try:
            if verb not in verbs:
                raise Refused("malformed", f"there is no control query {verb!r}")
            reply = verbs[verb](unpacked(payload) if payload else {}, query)
        except Refused as error:
            self._say_no(query, error.code, str(error))
        except (Bad, KeyError, TypeError, ValueError) as error:
            self._say_no(query, "malformed", f"{verb}: {type(error).__name__}: {error}")
        else:
            if reply is not None:
                _reply(query, reply)

    @staticmethod
    def _say_no(query: zenoh.Query, code: str, problem: str) -> None:
        _reply(query, {"code": code, "problems": [problem]}, error=True)

    def answer_parked(self) -> None:
        """Answer the queries whose wait is over."""
        for parked in list(self._parked):
            if parked.ready() or time.monotonic() >= parked.deadline:
                self._parked.remove(parked)
                _reply(parked.query, self.view(parked.finish()))

    def view(self, detail: Plain | None = None) -> Plain:
        """Return the component as it is now."""
        component = self._component
        prefix = component.key("topic") + "/"
        return {
            "component": component.name,
            "incarnation": component.incarnation,
            "state": component.state,
            "revision": component.revision,
            "parameters": {"gain": component.gain},
            "connect": {n: self.keys.get(n, "").removeprefix(prefix) for n in (INPUT, *OUTPUTS)},
            "detail": detail or {},
        }

    def _fence(self, wanted: Plain) -> None:
        component = self._component
        if component.term is None:
            return
        term = wanted.get("term")
        if term is None or term < component.term:
            raise Refused("fenced", f"came with term {term}; the current term is {component.term}")
        component.term = term

    def _note_revision(self, wanted: Plain) -> None:
        if wanted.get("revision") is not None:
            self._component.revision = wanted["revision"]
            self._component.beat()

    def _description(self) -> Plain:
        component = self._component
        return component.description

    def _transition(self, wanted: Plain, _: zenoh.Query) -> Plain:
        name = wanted["transition"]
        self._fence(wanted)
        self._component.transition(name)
        self._note_revision(wanted)
        return self.view()

    def _parameters(self, wanted: Plain, _: zenoh.Query) -> Plain:
        values = wanted.get("values", {})
        if values:
            self._fence(wanted)
            unknown = sorted(set(values) - {"gain"})
            if unknown:
                raise Refused("refused", f"{', '.join(unknown)}: no such parameter; there are: gain")
            gain = values["gain"]
            if isinstance(gain, bool) or not isinstance(gain, int | float) or not 0.0 <= gain <= 1.0:
                raise Refused("refused", f"gain = {gain!r}: must be a number from 0 to 1")
            self._component.gain = float(gain)
            self._note_revision(wanted)
        return self.view()

    def _state(self, wanted: Plain, _: zenoh.Query) -> Plain:
        component = self._component
        if wanted.get("step", "snapshot") == "snapshot":
            return {
                "component": component.name,
                "incarnation": component.incarnation,
                "stamp": component.now() / 1e9,
                "version": component.state_version,
                "state": {"handled": component.handled},
                "outputs": {key: writer.sequence for key, writer in component.writers.items()},
            }
        self._fence(wanted)
        if wanted.get("version") != component.state_version:
            raise Refused("refused", f"state: has version {wanted.get('version')}, must be {component.state_version}")
        component.handled = wanted["state"]["handled"]
        return self.view()

    # --- rewiring ---

    def _connections(self, wanted: Plain, query: zenoh.Query) -> Plain | None:
        step = wanted.get("step", "read")
        if step not in ("read", "await"):
            self._fence(wanted)
        if step == "read":
            return self.view()
        topic = wanted.get("topic", "")
        if step != "abandon" and not TOPIC.fullmatch(topic):
            raise Refused("refused", f"{topic!r} cannot name a topic")
        key = self._component.key("topic", topic)
        steps = {"open": self._open, "mark": self._mark, "await": self._await, "switch": self._switch}
        perform = steps.get(step, self._abandon)
        detail = perform(wanted.get("port", ""), key, wanted, query)
        self._note_revision(wanted)
        return None if detail is None else self.view(detail)

    def _open(self, name: str, key: str, _: Plain, __: Any) -> Plain:
        component = self._component
        if not self.keys.get(name):
            raise Refused("refused", f"there is no connected port {name!r}")
        if name == INPUT:
            if key == self.keys[INPUT] or self.move not in ("", key):
                raise Refused("refused", "the input is there already, or on its way elsewhere")
            if not self.move:
                self.move, self._marks, self._held = key, {}, []
                component.subscribe(key)
            return {}
        self._opened[name] = key
        writer = component.writer(key, OUTPUTS[name])
        writer.mark(component.now())
        return {"sequence": writer.sequence}

    def _mark(self, _: str, key: str, __: Plain, ___: Any) -> Plain:
        writer = self._component.writers.get(key)
        if writer is None:
            raise Refused("refused", f"no output is connected to {key}")
        writer.mark(self._component.now())
        return {"sequence": writer.sequence}

    def _await(self, name: str, key: str, wanted: Plain, query: zenoh.Query) -> None:
        def seen(peer: Plain) -> bool:
            source: str = peer["component"]
            incarnation: int = peer["incarnation"]
            if name == INPUT and self.move == key:
                return self._marks.get(source, (0, 0))[0] == incarnation
            return self._seen.get((key, source)) == incarnation

        def missing() -> list[str]:
            return [peer["component"] for peer in wanted.get("peers", []) if not seen(peer)]

        self._park(query, lambda: not missing(), lambda: {"missing": missing()})

    def _park(self, query: zenoh.Query, ready: Callable[[], bool], finish: Callable[[], Plain]) -> None:
        self._parked.append(Parked(query, ready, finish, time.monotonic() + AWAIT_AT_MOST))

    def _switch(self, name: str, key: str, wanted: Plain, query: zenoh.Query) -> Plain | None:
        component = self._component
        if name == INPUT:
            if self.move != key:
                raise Refused("refused", f"{name!r} has not been opened towards {key}")
            self._switch_input(wanted.get("cuts", {}), query)
            return None
        if self._opened.pop(name, None) != key:
            raise Refused("refused", f"{name!r} has not been opened towards {key}")
        old = self.keys[name]
        writer = component.writers[old]
        writer.mark(component.now())
        self.keys[name] = key
        if old not in self.keys.values():
            component.close_writer(old)
        return {"cut": writer.sequence}

    def _switch_input(self, cuts: dict[str, int], query: zenoh.Query) -> None:
        component = self._component
        old = self.keys[INPUT]

        def handled() -> bool:
            streams = component.streams.by_pair
            return all((old, s) in streams and (streams[old, s].handled or 0) >= cut for s, cut in cuts.items() if cut)

        def arrived() -> bool:
            streams = component.streams.by_pair
            return all((old, s) in streams and streams[old, s].reaches(cut) for s, cut in cuts.items() if cut)

        def finish() -> Plain:
            if component.stepped:
                complete = arrived()
                for source in sorted(s for s, cut in cuts.items() if cut and (old, s) in component.streams.by_pair):
                    component.ready += component.streams.by_pair[old, source].release(cuts[source])
                component.work()
            else:
                complete = handled()
            held = [h for h in self._held if h[1]["sequence"] > self._marks.get(h[1]["source"], (0, 0))[1]]
            self.keys[INPUT], self.move, self._held = self.move, "", []
            component.unsubscribe(old)
            component.ready += held
            component.work()
            return {"complete": complete}

        self._park(query, arrived if component.stepped else handled, finish)

    def _abandon(self, name: str, _: str, __: Plain, ___: Any) -> Plain:
        if name == INPUT and self.move:
            self._component.unsubscribe(self.move)
            self.move = ""
        opened = self._opened.pop(name, None)
        if opened and opened not in self.keys.values():
            self._component.close_writer(opened)
        return {}
