"""The nodes that replace others; they take any ports."""

from collections.abc import Callable, Mapping
from typing import Any, Final

from ..controls.sequences import Sequence
from ..data.values import to_type
from ..nodes.decorator import Decorator
from ..nodes.leaf import Condition, StatefulAction
from ..nodes.node import Node, NodeSetup
from ..script import compile_script
from ..status import COMPLETED, RUNNING, STATUS_NAMES, SUCCESS, Status
from .config import MockConfig

_STATUS_ENUM: Final = {name: number for number, name in enumerate(STATUS_NAMES)}
_NO_NAMES: Final[Mapping[str, int]] = {}


class _Outcome:
    """A config whose scripts are compiled for one node."""

    def __init__(self, node: Node, config: MockConfig) -> None:
        self._config = config
        self._node = node
        self._result = self._compiled(config.return_status_script, _STATUS_ENUM)
        self._on_success = self._compiled(config.success_script)
        self._on_failure = self._compiled(config.failure_script)
        self._post = self._compiled(config.post_script)

    def complete(self) -> Status:
        """Return the result, after running the scripts that belong to it."""
        status = self._config.return_status
        if self._result is not None:
            status = to_type(self._result(), Status, {})
        if status in COMPLETED:
            specific = self._on_success if status == SUCCESS else self._on_failure
            if specific is not None:
                specific()
        if self._post is not None:
            self._post()
        return status

    def _compiled(self, text: str, names: Mapping[str, int] = _NO_NAMES) -> Callable[[], Any] | None:
        enums = {**self._node.runtime.enums, **names}
        if not text:
            return None
        return compile_script(text, self._node.blackboard, enums, extensions=self._node.runtime.extensions)


class MockAction(StatefulAction):
    """An action that does nothing but what its config states."""

    def __init__(self, setup: NodeSetup, config: MockConfig | None = None) -> None:
        """Compile the scripts; without a config the action succeeds at once."""
        super().__init__(setup)
        self._config = config or MockConfig()
        self._outcome = _Outcome(self, self._config)
        self._deadline = 0.0

    def on_start(self) -> Status:
        """Complete, or start the timer."""
        if self._config.async_delay <= 0:
            return self._outcome.complete()
        self._deadline = self.runtime.timers.start(self.uid, self._config.async_delay / 1000.0)
        return RUNNING

    def on_running(self) -> Status:
        """Complete when the time has come."""
        return self._outcome.complete() if self.runtime.clock.now() >= self._deadline else RUNNING

    def on_halted(self) -> None:
        """Stop the timer."""
        self.runtime.timers.cancel(self.uid)


class MockCondition(Condition):
    """A condition that answers again at every tick what its config states."""

    def __init__(self, setup: NodeSetup, config: MockConfig | None = None) -> None:
        """Compile the scripts; without a config the condition holds."""
        super().__init__(setup)
        self._outcome = _Outcome(self, config or MockConfig())

    def tick(self) -> Status:
        """Return the config's result."""
        return self._outcome.complete()


class MockDecorator(Decorator):
    """A decorator that passes its child's result on."""

    def tick(self) -> Status:
        """Tick the child."""
        self.set_running()
        return self.child.execute_tick()


class MockControl(Sequence):
    """A control node that is a Sequence."""
