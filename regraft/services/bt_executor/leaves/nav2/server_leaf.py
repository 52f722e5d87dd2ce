"""The bases of leaves that ask Nav2's servers, and of those that call their services."""

from __future__ import annotations

from typing import Any, ClassVar

from behavior_tree import FAILURE, RUNNING, SUCCESS, Input, Output, Status
from regraft import CallFailed
from regraft.bus_schema.messages.protocol.requests import Answer
from regraft.services.bt_executor.leaves.asking_leaf import Asking, write_if_connected
from regraft.services.bt_executor.leaves.context import Asked

REJECTED, NOT_SENT = 1, 2
"""Nav2's error codes for a goal that is refused, and for one that no server takes."""
PATIENCE = 5.0
"""s until a goal is accepted or a service has answered, unless ``server_timeout`` states otherwise."""


class ServerLeaf(Asking):
    """The base: how long to wait for the server."""

    server_timeout = Input(float, default=0.0, description="how long to wait for the server, in ms; 0 is 5 s")

    @property
    def patience(self) -> float:
        """How long (s) to wait for the server."""
        given: float = self.server_timeout
        return given / 1000.0 if given > 0.0 else PATIENCE


class ServerAction(ServerLeaf):
    """Gives a server a goal. A halt cancels it. A goal that ends without a result is a FAILURE, as in Nav2.

    A motion that another client cancels by a service, as CancelControl does, has a result and is a SUCCESS. The error
    code stays readable after the end, 0 after a success.

    Attributes:
        server: The action, unless ``server_name`` names another.
        unknown: The error code of a goal that ends without a result.
    """

    server: ClassVar[str]
    unknown: ClassVar[int]

    server_name = Input(str, default="", description="the action; by default that of Nav2's name")
    error_code_id = Output(int, description="Nav2's number of the error, 0 for none")
    error_msg = Output(str, description="why it failed")

    @property
    def action(self) -> str:
        """The action's name."""
        given: str = self.server_name
        return given or self.server

    def give(self, goal: object, result: type[Any], feedback: type[Any] | None = None) -> Asked[Any]:
        """Give the server a goal."""
        return self.context.goal(self.action, goal, result, feedback, accept_within=self.patience)

    def unanswered(self, error: CallFailed) -> Status:
        """Take it that there is no result: the goal was refused, given up by its server, or lost with it."""
        super().unanswered(error)
        not_sent = error.answer is None
        code = REJECTED if error.answer is Answer.REFUSED else NOT_SENT if not_sent else self.unknown
        return self.aborted(code, str(error))

    def ended(self, answer: Any) -> Status:
        """Return the status of a result with an error's code and text."""
        if answer.error_code:
            self.failed(answer.error_msg)
            return self.aborted(answer.error_code, answer.error_msg)
        return self.done()

    def aborted(self, code: int, why: str) -> Status:
        """Report an error; returns FAILURE."""
        write_if_connected(self, "error_code_id", code)
        write_if_connected(self, "error_msg", why)
        return FAILURE

    def done(self) -> Status:
        """Report that there was no error; returns SUCCESS."""
        write_if_connected(self, "error_code_id", 0)
        write_if_connected(self, "error_msg", "")
        return SUCCESS


class ServerCall(ServerLeaf):
    """Calls a service; unlike other actions, it calls it again when it is ticked after its end.

    Attributes:
        service: The service, unless ``service_name`` names another; empty if the XML has to.
    """

    service: ClassVar[str] = ""

    service_name = Input(str, default="", description="the service; by default that of Nav2's name")

    def tick(self) -> Status:
        """Call, or look for the answer."""
        return self.on_running() if self.status == RUNNING else self.on_start()

    def call(self, request: object, reply: type[Any]) -> Asked[Any]:
        """Call the service; raises ValueError where it has no name."""
        name = self.service_name or self.service
        if not name:
            raise ValueError(f"{self.type_id} needs the port service_name")
        return self.context.call(name, request, reply, timeout=self.patience)
