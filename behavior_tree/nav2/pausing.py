"""The node that can be asked to pause."""

from collections.abc import Callable
from enum import Enum
from typing import ClassVar, Final

from ..nodes.control_node import Control
from ..nodes.node import NodeSetup
from ..nodes.ports import Input
from ..status import FAILURE, IDLE, RUNNING, SUCCESS, Status

OfferService = Callable[[str, Callable[[], bool]], object]
"""Called with a service's name and its function, which returns whether the request is accepted."""


class _State(Enum):
    """The actions of a PauseResumeController; the first four are the numbers of the children."""

    RESUMED = 0
    PAUSED = 1
    ON_PAUSE = 2
    ON_RESUME = 3
    PAUSE_REQUESTED = 4
    RESUME_REQUESTED = 5


_NEXT: Final = {
    _State.PAUSE_REQUESTED: _State.ON_PAUSE,
    _State.ON_PAUSE: _State.PAUSED,
    _State.RESUME_REQUESTED: _State.ON_RESUME,
    _State.ON_RESUME: _State.RESUMED,
}
_REQUESTS: Final = (_State.PAUSE_REQUESTED, _State.RESUME_REQUESTED)


class PauseResumeController(Control):
    """Ticks its first child until it is asked to pause, then the others, until it is asked to resume.

    The children are: while resumed, while paused, once when pausing, once when resuming; all but the first may be
    missing. It succeeds with the first child and fails with any. Pausing and resuming reset all children. As in Nav2
    the children are not reset when it completes: an action that keeps its result repeats it at the next start.
    """

    max_children: ClassVar[int | None] = 4

    pause_service_name = Input(str, description="the service that pauses")
    resume_service_name = Input(str, description="the service that resumes")

    def __init__(self, setup: NodeSetup, offer_service: OfferService | None = None) -> None:
        """Begin resumed; offer the two services if there is somebody to offer them to."""
        super().__init__(setup)
        self._state = _State.RESUMED
        if offer_service is not None:
            for port, request in (
                ("pause_service_name", self.request_pause),
                ("resume_service_name", self.request_resume),
            ):
                name = self.read_port_or(port)
                if name is not None:
                    offer_service(name, request)

    @property
    def is_paused(self) -> bool:
        """Whether it has paused and not been asked to resume."""
        return self._state is _State.PAUSED

    def request_pause(self) -> bool:
        """Pause with the next tick; refused, with False, if it is paused already."""
        if self._state is _State.PAUSED:
            return False
        self._state = _State.PAUSE_REQUESTED
        self.request_wake_up()
        return True

    def request_resume(self) -> bool:
        """Resume with the next tick; refused, with False, unless it is paused."""
        if self._state is not _State.PAUSED:
            return False
        self._state = _State.RESUME_REQUESTED
        self.request_wake_up()
        return True

    def tick(self) -> Status:
        """Follow a request, then tick the child that belongs to the state."""
        if self.status == IDLE:
            self._state = _State.RESUMED
        self.set_running()
        if self._state in _REQUESTS:
            self.reset_children()
            self._state = _NEXT[self._state]
        index = self._state.value
        if index >= len(self.children):
            self._go_on()
            return RUNNING
        status = self.children[index].execute_tick()
        if status in (RUNNING, FAILURE):
            return status
        if self._state is _State.RESUMED:
            return SUCCESS
        self._go_on()
        return RUNNING

    def halt(self) -> None:
        """Reset all children and be resumed."""
        self._state = _State.RESUMED
        super().halt()

    def _go_on(self) -> None:
        self._state = _NEXT.get(self._state, self._state)
