"""Walks a component through its lifecycle: hooks, ports, timers, tasks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bus_schema.model.lifecycle import TRANSITIONS, State, Transition, legal, route
from regraft.bus import Closable
from regraft.component import restore_state
from regraft.runtime.inputs import TopicReader
from regraft.runtime.stillness import Stillness

if TYPE_CHECKING:
    from regraft.runtime.runtime import Runtime


class TransitionFailed(Exception):
    """A transition that is not legal, or whose hook raised; the text says which."""


class Lifecycle:
    """The state of one component, and the way from one to the next."""

    def __init__(self, runtime: Runtime) -> None:
        """Begin unconfigured."""
        self._runtime = runtime
        self._subscriptions: dict[str, Closable] = {}
        self._connected = False
        self._still: Stillness | None = None

    def perform(self, transition: Transition, *, hold: bool = False) -> None:
        """Go through one transition.

        ``hold`` keeps what comes for the inputs of what is deactivated: if it is activated again, it is handled then.

        Raises:
            TransitionFailed: it is not legal here (nothing happened), or its hook raised (see the state afterwards).
        """
        state = self._runtime.state
        way = TRANSITIONS.get((state, transition))
        if way is None:
            possible = ", ".join(t.value for t in legal(state)) or "none"
            raise TransitionFailed(f"{transition.value} is not possible while {state.value}; possible: {possible}")
        self._runtime.herald.say(state=way[0])
        if hold and state is State.ACTIVE:
            self._hold_still()
        try:
            getattr(self, f"_{transition.value}")(state)
        except Exception as error:
            self._runtime.herald.fault(f"on_{transition.value}", error)
            self._recover()
            now = self._runtime.state.value
            raise TransitionFailed(f"{transition.value}: {type(error).__name__}: {error}; now {now}") from error
        self._runtime.herald.say(state=way[1])
        self._runtime.herald.event(
            "component.transition", f"{state.value} to {way[1].value}", transition=transition.value
        )

    def reach(self, goal: State) -> None:
        """Go through the transitions that lead to ``goal``; raises TransitionFailed."""
        way = route(self._runtime.state, goal)
        if way is None:
            raise TransitionFailed(f"{goal.value} cannot be reached from {self._runtime.state.value}")
        for transition in way:
            self.perform(transition)

    def _configure(self, _: State) -> None:
        if not self._connected:
            self.connect()
        self._runtime.component.on_configure()

    def _activate(self, _: State) -> None:
        self._restore()
        self._runtime.component.on_activate()
        self._pause(False)
        self._go_on()
        self._runtime.start_timers()

    def _deactivate(self, _: State) -> None:
        self._stop_acting("the component was deactivated")
        self._runtime.component.on_deactivate()

    def _cleanup(self, _: State) -> None:
        self._runtime.component.on_cleanup()
        self.disconnect()

    def _shutdown(self, state: State) -> None:
        if state is State.ACTIVE:
            self._stop_acting("the component is shutting down")
            self._runtime.component.on_deactivate()
        self._runtime.component.on_shutdown()
        self.disconnect()

    def let_go(self) -> None:
        """Deactivate and clean up, but stay on the bus: another run needs what this one holds for itself.

        What an author's method raises is reported; whether all was let go shows when the other run is configured.
        """
        runtime = self._runtime
        if runtime.state is State.ACTIVE:
            self._stop_acting("the component is handed over")
            runtime.guarded("on_deactivate", runtime.component.on_deactivate)
            runtime.herald.say(state=State.INACTIVE)
        runtime.guarded("on_cleanup", runtime.component.on_cleanup)
        runtime.herald.say(state=State.UNCONFIGURED)

    def _pause(self, paused: bool) -> None:
        for port in self._runtime.inputs.values():
            if port.still is not None:
                continue  # it goes on reading
            port.paused = paused

    def _hold_still(self) -> None:
        self._still = Stillness()
        for port in self._runtime.inputs.values():
            if port.reliable:
                port.still = self._still

    def _go_on(self) -> None:
        still, self._still = self._still, None
        for port in self._runtime.inputs.values():
            port.still = None
        if still is not None:
            still.give_out()

    def _restore(self) -> None:
        checkpoint = self._runtime.control.take_checkpoint()
        if checkpoint is not None:
            restore_state(self._runtime.component, checkpoint.state, checkpoint.version)

    def _stop_acting(self, why: str) -> None:
        runtime = self._runtime
        self._pause(True)
        runtime.timers.stop_all()
        for server in runtime.servers:
            server.end_goals(why)
        runtime.tasks.cancel_all()
        runtime.caller.cancel_all()

    def _recover(self) -> None:
        """Error processing, as ROS 2 has it: unconfigured if ``on_error`` returns, finalized if it raises."""
        runtime = self._runtime
        runtime.herald.say(state=State.ERROR_PROCESSING)
        self._stop_acting("the component failed")
        try:
            runtime.component.on_error()
            state = State.UNCONFIGURED
        except Exception as error:
            runtime.herald.fault("on_error", error)
            state = State.FINALIZED
        self.disconnect()
        runtime.herald.say(state=state)

    # --- ports on the bus ---

    def connect(self) -> None:
        """Put all ports on the bus, before the component is configured: nothing is handled until it is active."""
        self._connected = True
        runtime = self._runtime
        connections = runtime.assignment.connections
        for name, port in runtime.inputs.items():
            key = runtime.keys.topic(connections.get(name, port.declared.topic or name))
            port.connect(key, reliable=runtime.is_reliable(key))
            self.also_read(name, key)
        for name, output in runtime.outputs.items():
            key = runtime.keys.topic(connections.get(name, output.declared.topic or name))
            output.connect(key, reliable=runtime.is_reliable(key))

    def also_read(self, name: str, key: str) -> None:
        """Subscribe an input's second key, beside the one it has."""
        runtime = self._runtime
        port = runtime.inputs[name]
        reader = runtime.reader(key)
        if reader is None:
            runtime.inbound.add(key, TopicReader((port,)))
            self._subscriptions[key] = runtime.bus.subscribe(key, runtime.take_in)
        elif port not in reader.ports:
            reader.read_by(*reader.ports, port)

    def stop_reading(self, name: str, key: str) -> None:
        """Take an input off a key; the subscription ends with its last reader."""
        runtime = self._runtime
        reader = runtime.reader(key)
        port = runtime.inputs[name]
        if reader is None or port not in reader.ports:
            return
        reader.read_by(*(other for other in reader.ports if other is not port))
        if not reader.ports:
            runtime.inbound.remove(key)
            subscription = self._subscriptions.pop(key, None)
            if subscription:
                subscription.close()

    def disconnect(self) -> None:
        """Take all ports off the bus and forget what they received."""
        self._connected = False
        self._still = None
        runtime = self._runtime
        for name, port in runtime.inputs.items():
            for key in filter(None, (port.key, port.move.key if port.move else "")):
                self.stop_reading(name, key)
            port.key, port.move, port.paused, port.still = "", None, True, None
            port.forget()
        runtime.rewiring.forget()
        for output in runtime.outputs.values():
            output.disconnect()
