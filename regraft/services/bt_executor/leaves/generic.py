"""The leaves that ask any service and any action, by the names of their message types."""

from __future__ import annotations

from typing import Any, ClassVar

from behavior_tree import SUCCESS, Input, Node, Output, Status
from regraft.bus_schema.annotations import PlainValue
from regraft.bus_schema.encoding import codec
from regraft.services.bt_executor.leaves.asking_leaf import Asking, write_if_connected
from regraft.services.bt_executor.leaves.context import Asked
from regraft.services.bt_executor.leaves.plain_messages import (
    as_plain,
    field_of,
    filled,
    make_message,
    message_type,
    read_json,
)


class _Generic(Asking):
    """The base of CallService and CallAction: types by name, messages as JSON.

    Attributes:
        type_ports: The ports that name message types.
        body_port: The port with what is sent.
    """

    type_ports: ClassVar[tuple[str, ...]]
    body_port: ClassVar[str]

    field = Input(str, default="", description="the dotted path of the one field of the answer to write")
    value = Output[Any](description="that field; not written where the field is empty")

    def adopt(self, children: tuple[Node, ...]) -> None:
        """Check types, JSON and ports as far as the XML gives them; see `Node.adopt`."""
        super().adopt(children)
        for port in self.type_ports:
            if self.has_literal(port):
                message_type(self.read_port(port))
        text = self.setup.attributes.get(self.body_port, "")
        if '"' in text and not self.has_literal(self.body_port):
            raise ValueError(f"port '{self.body_port}': write json: before {text}, or it is taken for a blackboard key")
        if self.has_literal(self.body_port):
            read_json(text)

    def body(self, type_port: str) -> object:
        """Return the message to send."""
        given = self.read_port(self.body_port)
        plain = read_json(given) if isinstance(given, str) else as_plain(given)
        return make_message(filled(plain, self.blackboard), message_type(self.read_port(type_port)))

    def written(self, port: str, answer: object) -> Status:
        """Write the answer and the wanted field of it."""
        plain: PlainValue = codec.to_plain(answer)
        write_if_connected(self, port, plain)
        if self.field:
            value = field_of(plain, self.field)
            if value is not None:
                write_if_connected(self, "value", value)
        return SUCCESS


class CallService(_Generic):
    """Calls any service; succeeds when it has answered.

        <CallService service="detect" request_type="regraft/Detect" reply_type="regraft/Sightings"
                     request='json:{"label": "hydrant"}' field="hits" value="{hits}"/>

    A text ``{key}`` within the JSON represents the value of a blackboard entry.
    """

    required_ports = ("service", "request_type", "reply_type")
    type_ports = ("request_type", "reply_type")
    body_port = "request"

    service = Input(str, description="the service")
    request_type = Input(str, description="the request's message type: package/Name, or module:Class")
    reply_type = Input(str, description="the reply's message type")
    request = Input[Any](default="json:{}", description="the request: json:{...}, or an entry with a map or message")
    timeout = Input(float, default=5.0, description="seconds to wait for the answer")
    reply = Output[Any](description="the reply as a map")

    def ask(self) -> Asked[Any]:
        """Call the service."""
        reply = message_type(self.reply_type).cls
        return self.context.call(self.service, self.body("request_type"), reply, timeout=self.timeout)

    def answered(self, answer: object) -> Status:
        """Write the reply."""
        return self.written("reply", answer)


class CallAction(_Generic):
    """Gives any action a goal; succeeds when it ended with a result, and cancels the goal when it is halted.

    Whether the result is a good one depends on its type: give ``field`` and test its ``value``.
    """

    required_ports = ("action", "goal_type", "result_type")
    type_ports = ("goal_type", "result_type", "feedback_type")
    body_port = "goal"

    action = Input(str, description="the action")
    goal_type = Input(str, description="the goal's message type: package/Name, or module:Class")
    result_type = Input(str, description="the result's message type")
    feedback_type = Input(str, default="", description="the feedback's message type, empty for none")
    goal = Input[Any](default="json:{}", description="the goal: json:{...}, or an entry with a map or message")
    accept_within = Input(float, default=5.0, description="seconds in which the goal must be accepted")
    result = Output[Any](description="the result as a map")
    feedback = Output[Any](description="the latest feedback as a map")

    def ask(self) -> Asked[Any]:
        """Give the goal."""
        feedback = message_type(self.feedback_type).cls if self.feedback_type else None
        result = message_type(self.result_type).cls
        goal = self.body("goal_type")
        return self.context.goal(self.action, goal, result, feedback, accept_within=self.accept_within)

    def progress(self, feedback: object) -> None:
        """Write the feedback."""
        write_if_connected(self, "feedback", codec.to_plain(feedback))

    def answered(self, answer: object) -> Status:
        """Write the result."""
        return self.written("result", answer)
