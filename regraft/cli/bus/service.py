"""``regraft service``, ``action`` and ``goal``: asking what components offer."""

from __future__ import annotations

import queue
import time
from typing import Annotated

import typer

from regraft.bus_schema.annotations import PlainValue
from regraft.cli.bus import message_types
from regraft.cli.bus.sampling import Backlog, tell_missed
from regraft.cli.outcomes import INTERRUPTED
from regraft.cli.running_system import Reached, reached
from regraft.cli.terminal.options import JsonOption, RobotOption, SystemOption, TimeoutOption
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.cli.terminal.values import document
from regraft.cli.topology import Offer
from regraft.client import ClientGoal
from regraft.client import as_json as shown
from regraft.component.errors import CallFailed

service = typer.Typer(help="List and call services.", no_args_is_help=True, rich_markup_mode=None)
action = typer.Typer(help="List actions, and send them goals.", no_args_is_help=True, rich_markup_mode=None)
goal = typer.Typer(help="Send goals to actions.", no_args_is_help=True, rich_markup_mode=None)

CANCEL_TIMEOUT = 5.0
LOOK_INTERVAL = 0.2

BodyArgument = Annotated[str, typer.Argument(metavar="[BODY]", help="The fields in JSON or YAML; none by default.")]


@service.command("list")
def list_services(
    ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False
) -> None:
    """List services with their types and who offers them."""
    with reached(ctx, system) as there:
        _list(list(there.known.of_robot(robot).offers("service").values()), "services", json=as_json)


@action.command("list")
def list_actions(
    ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False
) -> None:
    """List actions with their types and who offers them."""
    with reached(ctx, system) as there:
        _list(list(there.known.of_robot(robot).offers("action").values()), "actions", json=as_json)


def _list(offers: list[Offer], kind: str, *, json: bool) -> None:
    if json:
        show_json({kind: [offer.plain() for offer in offers]})
        return
    rows = (
        (
            offer.name,
            offer.component,
            offer.description.request,
            offer.description.reply,
            *((offer.description.goals,) if kind == "actions" else ()),
            offer.description.description,
        )
        for offer in offers
    )
    goals = ("goals",) if kind == "actions" else ()
    show_table((kind[:-1], "component", "request", "reply", *goals, ""), rows, empty=f"no {kind}")


@service.command("call")
def call(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="SERVICE")],
    body: BodyArgument = "",
    timeout: TimeoutOption = 5.0,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Call a service and print its reply."""
    with reached(ctx, system) as there:
        request = _request(there, name, "service", body)
        show_reply(there.client.call_plain(name, request, timeout), as_json=as_json)


@action.command("send")
@goal.command("send")
def send(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="ACTION")],
    body: BodyArgument = "",
    feedback: Annotated[bool, typer.Option("--feedback", help="Print feedback as it comes.")] = False,
    detach: Annotated[bool, typer.Option("--detach", help="Return once it is accepted; the goal continues.")] = False,
    timeout: TimeoutOption = 3600.0,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Send an action a goal and print its result; Ctrl-C cancels the goal, as every end of this command does."""
    with reached(ctx, system) as there:
        request = _request(there, name, "action", body)
        heard: Backlog[PlainValue] = Backlog()
        pursued = there.client.goal_plain(name, request, on_feedback=heard.take if feedback else None, outlives=detach)
        if detach:
            if as_json:
                show_json({"action": name, "accepted": True})
            else:
                complain(f"{name} has accepted the goal")
            return
        result = _result(pursued, timeout, heard, as_json=as_json)
        show_reply(result, as_json=as_json, compact=feedback)


def _result(
    pursued: ClientGoal[PlainValue, PlainValue], timeout: float, heard: Backlog[PlainValue], *, as_json: bool
) -> PlainValue:
    """Show feedback until a goal's end, and return its result; if nobody waits for it any more, it is cancelled."""
    deadline = time.monotonic() + timeout
    try:
        # Waiting in short steps lets Ctrl-C through.
        while not pursued.done and time.monotonic() < deadline:
            _show_feedback(heard, min(LOOK_INTERVAL, max(0.0, deadline - time.monotonic())), as_json)
        if pursued.done:
            while _show_feedback(heard, 0.0, as_json):
                pass
            tell_missed(heard.missed)
            return pursued.result(CANCEL_TIMEOUT)
        _cancel(pursued)
        raise CallFailed("goal", None, f"had not ended after {timeout:g} s, and was cancelled")
    except KeyboardInterrupt:
        complain("cancelling the goal ...")
        _cancel(pursued)
        raise typer.Exit(INTERRUPTED) from None


def _show_feedback(heard: Backlog[PlainValue], seconds: float, as_json: bool) -> bool:
    """Show the feedback that comes next, if some does in time; return whether it did."""
    try:
        message = heard.get(seconds)
    except queue.Empty:
        return False
    show_reply(message, as_json=as_json, compact=True)
    return True


def _cancel(pursued: ClientGoal[PlainValue, PlainValue]) -> None:
    pursued.cancel()
    try:
        pursued.result(CANCEL_TIMEOUT)
    except CallFailed as error:
        complain(str(error))


def _request(there: Reached, name: str, kind: str, body: str) -> PlainValue:
    """Return the request that a typed body represents, as plain data; raises BadInput."""
    fields = document(body, "the body") if body.strip() else None
    offer = there.known.offer(name, kind)
    request = message_types.described(there, offer.description.request, offer.component)
    return message_types.packed(request, fields)


def show_reply(message: PlainValue, *, as_json: bool, compact: bool = False) -> None:
    """Print the plain data of a message, as JSON or one field per line."""
    if as_json:
        show_json(message, compact=compact)
    elif isinstance(message, dict):
        for field, value in shown(message).items():
            say(f"{field}: {value}")
    else:
        say(str(shown(message)))
