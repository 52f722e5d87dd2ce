"""The base of all adapt decorators: what they share, whenever they adapt."""

from __future__ import annotations

from collections.abc import Mapping

from behavior_tree import FAILURE, RUNNING, Node, NodeSetup, Status
from regraft.bus_schema.annotations import PlainValue
from regraft.services.bt_executor.adaptation.attempt import Attempt
from regraft.services.bt_executor.adaptation.dialogue import AttemptSteps
from regraft.services.bt_executor.adaptation.external import ExternalStrategy
from regraft.services.bt_executor.adaptation.internal import InternalPlan
from regraft.services.bt_executor.adaptation.node import AdaptNode
from regraft.services.bt_executor.adaptation.port_values.options import option_text
from regraft.services.bt_executor.adaptation.port_values.ports import check_ports
from regraft.services.bt_executor.adaptation.results import Result
from regraft.services.bt_executor.leaves.asking_leaf import write_if_connected
from regraft.services.bt_executor.leaves.context import LeafContext


class AdaptDecorator(AdaptNode):
    """Adapts the running system for the sake of its child (ReBeT, section III-C).

    The changes are decided by rules in the XML (port ``rules``), a subclass's ``plan``, or a planner (port
    ``adaptation_strategy``). The variants decide when. Ticks never wait: while an answer is outstanding the decorator
    is RUNNING. A child that completes meanwhile is not ticked again. Its result is returned as soon as the answer is
    there, or its time is over. A halt gives the request up: its changes may still be applied.

    The ports ``on_...`` decide what follows when an adaptation came to nothing; the decorator then continues unchanged,
    tries again, or halts its child and fails.
    """

    def __init__(self, setup: NodeSetup, context: LeafContext) -> None:
        super().__init__(setup, context)
        self.under_way = Attempt(self)
        self._internal = InternalPlan(self)
        self._external = ExternalStrategy(self)
        self._result: Status | None = None
        self._started = False

    # --- for authors ---

    def current(self, component: str, parameter: str) -> PlainValue:
        """Return what a parameter should be in the architecture, within ``plan``.

        If that has to be asked for first, the plan is left here and asked again.

        Raises:
            NotKnown: it has to be asked for.
            Impossible: there is no such parameter.
        """
        return self._internal.current(component, parameter)

    # --- for the variants ---

    def holds_child_back(self) -> bool:
        """Return whether the child has to wait for the adaptation."""
        return False

    def on_started(self) -> None:
        """Begin again, before the child is ticked for the first time."""

    def on_child_ticked(self, status: Status) -> None:
        """Begin an adaptation, if it is time."""

    def next_time(self) -> float | None:
        """Return when the node wants to be ticked, in seconds of the tree's clock, None if at no certain time."""
        return self.under_way.again_at

    # --- for the attempt ---

    def attempt(self) -> AttemptSteps:
        """Decide, and have it carried out."""
        return self._external.attempt() if self.is_external else self._internal.attempt()

    def tell_choice(self, choice: Mapping[str, PlainValue]) -> None:
        """Report what a planner has chosen; without an option the ports are empty."""
        option = choice.get("option")
        chosen = option if isinstance(option, dict) else {}
        write_if_connected(self, "choice", " | ".join(map(option_text, chosen.values())))
        write_if_connected(self, "option", dict(chosen))
        why = choice.get("why")
        write_if_connected(self, "why", why if isinstance(why, str) else "")

    def tell(self, result: Result) -> None:
        """Report how an adaptation ended."""
        write_if_connected(self, "outcome", result.outcome)
        write_if_connected(self, "reason", result.reason)
        if result.applied:
            self.adapted(result)
        if not result.good:
            self.context.kit.log.warning("%s: the adaptation came to %s: %s", self.path, result.outcome, result.reason)

    # --- as a node ---

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check the ports as far as the XML gives them; see `Node.adopt`."""
        super().adopt(children)
        check_ports(self, has_own_plan=type(self).plan is not AdaptNode.plan)
        self._internal.check()
        self._external.check()

    def tick(self) -> Status:
        """Take answers, tick the child unless it has completed, adapt; never wait."""
        self.set_running()
        if not self._started:
            self._started = True
            self.on_started()
        self.under_way.look()
        if not self.under_way.failed and self._result is None and not self.holds_child_back():
            self._tick_child()
        if self.under_way.failed:
            self._clear()
            self.child.reset()
            return FAILURE
        if self._result is None or self.under_way.busy:
            self._set_timer()
            return RUNNING
        result = self._result
        self._clear()
        return result

    def halt(self) -> None:
        """Give up what is under way, and halt the child."""
        self._clear()
        super().halt()

    def _tick_child(self) -> None:
        status = self.child.execute_tick()
        self._external.measure()
        if status != RUNNING:
            # The engine resets a child that completed, but not one that is skipped in the middle.
            self.child.reset()
            self._result = status
            self._external.pause()
        self.on_child_ticked(status)

    def _set_timer(self) -> None:
        then = self.next_time()
        if then is not None and then > self.now():
            self.runtime.timers.start(self.uid, then - self.now())
        else:
            self.runtime.timers.cancel(self.uid)

    def _clear(self) -> None:
        self.under_way.give_up()
        self._external.pause()
        self.runtime.timers.cancel(self.uid)
        self._result = None
        self._started = False
