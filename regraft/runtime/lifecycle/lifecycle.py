"""Walks a component through its lifecycle: hooks, ports, timers, tasks."""

from __future__ import annotations

from regraft.bus_schema.model.lifecycle import TRANSITIONS, State, Transition, legal, route
from regraft.bus_schema.texts import encodable, told
from regraft.runtime.lifecycle.checkpoints import Checkpoints
from regraft.runtime.lifecycle.connections import Connections
from regraft.runtime.lifecycle.periodic import PeriodicCalls
from regraft.runtime.lifecycle.port_rewiring import Rewiring
from regraft.runtime.parts import Parts


class TransitionFailed(Exception):
    """A transition that is not legal, or whose hook raised; the text states which."""

    def __init__(self, why: str) -> None:
        super().__init__(encodable(why))


class ComponentFailed(Exception):
    """The component called ``kit.fail`` in a hook; the text is why."""


class Lifecycle:
    """The state of one component, and the way from one to the next."""

    def __init__(
        self,
        parts: Parts,
        connections: Connections,
        rewiring: Rewiring,
        checkpoints: Checkpoints,
        periodic: PeriodicCalls,
    ) -> None:
        self._parts = parts
        self._connections = connections
        self._rewiring = rewiring
        self._checkpoints = checkpoints
        self._periodic = periodic

    def perform(self, transition: Transition, *, hold: bool = False) -> None:
        """Go through one transition.

        ``hold`` keeps what comes for the inputs of what is deactivated: if it is activated again, it is handled then.

        Raises:
            TransitionFailed: it is not legal here (nothing happened), or its hook raised (see the state afterwards).
        """
        state = self._parts.state
        way = TRANSITIONS.get((state, transition))
        if way is None:
            possible = ", ".join(t.value for t in legal(state)) or "none"
            raise TransitionFailed(f"{transition.value} is not possible while {state.value}; possible: {possible}")
        self._parts.reporter.update(state=way[0])
        if hold and state is State.ACTIVE:
            self._connections.hold()
        try:
            getattr(self, f"_{transition.value}")(state)
            self._raise_if_failing()
        except ComponentFailed as error:
            self._recover("failed", str(error))
            now = self._parts.state.value
            raise TransitionFailed(f"{transition.value}: {error}; now {now}") from error
        except Exception as error:
            self._parts.reporter.fault(f"on_{transition.value}", error)
            self._recover("hook_raised", f"on_{transition.value}: {told(error)}")
            now = self._parts.state.value
            raise TransitionFailed(f"{transition.value}: {told(error)}; now {now}") from error
        self._parts.reporter.update(state=way[1])
        if transition is Transition.CONFIGURE:
            self._parts.reporter.recovered("configured", "configured again")
        self._parts.reporter.event(
            "component.transition", f"{state.value} to {way[1].value}", transition=transition.value
        )

    def fail(self) -> None:
        """Leave the state for error processing, as the component wants; one that is not configured stays as it is."""
        why, self._parts.failing = self._parts.failing, ""
        if self._parts.state in (State.ACTIVE, State.INACTIVE):
            self._recover("failed", why)

    def _raise_if_failing(self) -> None:
        why, self._parts.failing = self._parts.failing, ""
        if why:
            raise ComponentFailed(why)

    def reach(self, goal: State) -> None:
        """Go through the transitions that lead to ``goal``; raises TransitionFailed."""
        way = route(self._parts.state, goal)
        if way is None:
            raise TransitionFailed(f"{goal.value} cannot be reached from {self._parts.state.value}")
        for transition in way:
            self.perform(transition)

    def _configure(self, _: State) -> None:
        self._connections.connect()
        self._parts.component.on_configure()

    def _activate(self, _: State) -> None:
        self._checkpoints.restore_assigned()
        try:
            self._parts.component.on_activate()
            self._connections.resume()
            self._periodic.start()
            self._raise_if_failing()
        except Exception:
            self._checkpoints.keep_assigned()
            raise

    def _deactivate(self, _: State) -> None:
        self._stop_acting("the component was deactivated")
        self._parts.component.on_deactivate()

    def _cleanup(self, _: State) -> None:
        self._parts.component.on_cleanup()
        self.disconnect()

    def _shutdown(self, state: State) -> None:
        if state is State.ACTIVE:
            self._stop_acting("the component is shutting down", can_be_asked=False)
            self._parts.component.on_deactivate()
        self._parts.component.on_shutdown()
        self.disconnect()

    def let_go(self) -> None:
        """Deactivate and clean up, but stay on the bus: another run needs what this one holds for itself.

        Exceptions of an author's method are reported; the next configuration shows whether all was released.
        """
        parts = self._parts
        if parts.state is State.ACTIVE:
            self._stop_acting("the component is handed over")
            parts.guarded("on_deactivate", parts.component.on_deactivate)
            parts.reporter.update(state=State.INACTIVE)
        parts.guarded("on_cleanup", parts.component.on_cleanup)
        parts.reporter.update(state=State.UNCONFIGURED)

    def _stop_acting(self, why: str, *, can_be_asked: bool = True) -> None:
        parts = self._parts
        # A process that ends makes no message for later readers: the system may be ending, and all that it is made of.
        if can_be_asked:
            parts.writers.make_last_deferred()
        else:
            parts.writers.flush()
        self._connections.pause()
        parts.timers.stop_all()
        for server in parts.servers:
            server.end_goals(why)
        parts.tasks.cancel_all()
        parts.requests.cancel_all()

    def _recover(self, code: str, why: str) -> None:
        """Error processing, as ROS 2 has it: unconfigured if ``on_error`` returns, finalized if it raises or fails."""
        parts = self._parts
        parts.reporter.update(state=State.ERROR_PROCESSING)
        self._stop_acting("the component failed")
        parts.failing = ""  # the reasons until here are being processed
        try:
            parts.component.on_error()
            self._raise_if_failing()
            state = State.UNCONFIGURED
        except Exception as error:
            parts.reporter.fault("on_error", error)
            state = State.FINALIZED
        self.disconnect()
        parts.reporter.failed(code, why, state)

    def disconnect(self) -> None:
        """Take all ports off the bus, and give up every move that was begun."""
        self._connections.disconnect()
        self._rewiring.forget()
