"""``regraft topic``: looking at topics, and putting a message on one."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Annotated

import typer

from regraft.bus_schema.keys import topic_name
from regraft.bus_schema.suggestions import instead_of
from regraft.cli.bus import message_types
from regraft.cli.bus.gaps import with_gaps_told
from regraft.cli.bus.rates import rates_of
from regraft.cli.bus.sampling import CountOption, ForOption, OnceOption, samples
from regraft.cli.outcomes import BadInput, Failed
from regraft.cli.running_system import Reached, reached
from regraft.cli.terminal.options import JsonOption, RobotOption, SystemOption
from regraft.cli.terminal.output import complain, say, show_json, show_table
from regraft.cli.terminal.values import document
from regraft.cli.topology import TopicUse, topology
from regraft.client import TopicSample, as_json, read_plain

topic = typer.Typer(help="Look at topics.", no_args_is_help=True, rich_markup_mode=None)

KNOWN_TIMEOUT = 2.0
"""Seconds within which a topic must be known or carry something."""
LOOK_INTERVAL = 0.1
MAX_SHOWN_LENGTH = 400

TopicArgument = Annotated[str, typer.Argument(metavar="TOPIC")]


@topic.command("list")
def list_topics(
    ctx: typer.Context, robot: RobotOption = "", system: SystemOption = None, as_json: JsonOption = False
) -> None:
    """List topics with their types, who writes and who reads them."""
    with reached(ctx, system) as there:
        uses = list(there.known.of_robot(robot).uses().values())
    if as_json:
        show_json({"topics": [use.plain() for use in uses]})
        return
    rows = ((use.name, use.type, _carried(use), _names(use.writers), _names(use.readers)) for use in uses)
    show_table(("topic", "type", "carried", "written by", "read by"), rows, empty="no topics")


def _names(ends: list[tuple[str, str]]) -> str:
    return ", ".join(dict.fromkeys(component for component, _ in ends))


def _carried(use: TopicUse) -> str:
    if use.spec is None:
        return ""
    rate = f", {use.spec.rate:g} Hz" if use.spec.rate else ""
    return f"{'reliable' if use.spec.reliable else 'sensor stream'}{rate}"


@topic.command("info")
def info(ctx: typer.Context, name: TopicArgument, system: SystemOption = None, as_json: JsonOption = False) -> None:
    """Show a topic's type and which ports write and read it."""
    with reached(ctx, system) as there:
        use = there.known.use(name)
    plain = use.plain()
    if as_json:
        show_json(plain)
        return
    say(f"type: {use.type}")
    say(f"carried: {_carried(use) or 'as its writers choose'}")
    for side in ("writers", "readers"):
        say(f"{side}: {', '.join(map(str, plain[side])) or 'none'}")  # type: ignore[call-overload]


@topic.command("echo")
def echo(
    ctx: typer.Context,
    name: TopicArgument,
    count: CountOption = None,
    duration: ForOption = None,
    once: OnceOption = False,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print the messages on a topic as they come; as JSON, one document per line."""
    with reached(ctx, system) as there:
        _check(there, name)
        seen = 0
        for sample in with_gaps_told(_samples(there, name, 1 if once else count, duration)):
            seen += 1
            _show(sample, as_json)
    if (once or count) and not seen:
        raise Failed(f"nothing came on {name} within {duration:g} s" if duration else f"nothing came on {name}")


def _check(there: Reached, name: str) -> None:
    """Warn of a topic that nobody writes; raise BadInput for one that no component knows and nothing comes on.

    A component that has just started is not described yet, and a program may never be: they get a moment.
    """
    topic_name(name)
    heard = threading.Event()
    deadline = time.monotonic() + KNOWN_TIMEOUT
    with there.client.topic(name, None, lambda _: heard.set()):
        while name not in (uses := (found := topology(there.client)).uses()):
            if heard.wait(LOOK_INTERVAL):
                return
            if time.monotonic() > deadline:
                for why in found.silent.values():
                    complain(f"{why}: it is left out")
                raise BadInput(
                    f"no component knows the topic {name!r}, and nothing comes on it; {instead_of(name, uses)}"
                )
    if not uses[name].writers:
        complain(f"{name} has no writer now; waiting")


def _samples(there: Reached, name: str, count: int | None, duration: float | None) -> Iterator[TopicSample]:
    return samples(lambda take: there.client.topic(name, None, take), count, duration, there.check)


def _show(sample: TopicSample, json: bool) -> None:
    if json:
        plain = {
            name: getattr(sample, name) for name in ("topic", "type", "source", "incarnation", "sequence", "stamp")
        }
        show_json({**plain, "message": sample.message}, compact=True)
        return
    say(f"{sample.stamp / 1e9:.3f} s, {sample.source}, number {sample.sequence}")
    fields = as_json(sample.message)
    for field, value in fields.items() if isinstance(fields, dict) else [("", fields)]:
        text = f"  {field}: {value}"
        say(text if len(text) <= MAX_SHOWN_LENGTH else f"{text[:MAX_SHOWN_LENGTH]}...")


@topic.command("hz")
def hz(
    ctx: typer.Context,
    name: TopicArgument,
    count: CountOption = None,
    duration: ForOption = None,
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Measure how often messages come: by the wall clock, and by the stamps of their sender's clock."""
    with reached(ctx, system) as there:
        _check(there, name)
        rates = rates_of(_samples(there, name, count, duration), shown=not as_json)
    if not rates.count:
        raise Failed(f"nothing came on {name}")
    if as_json:
        show_json({"topic": name, **rates.plain()})
    else:
        say(rates.line())


@topic.command("pub")
def pub(
    ctx: typer.Context,
    name: TopicArgument,
    body: Annotated[str, typer.Argument(metavar="BODY", help="The message's fields in JSON or YAML.")],
    kind: Annotated[str, typer.Option("--type", metavar="TYPE", help="The message type; by default the topic's.")] = "",
    system: SystemOption = None,
    as_json: JsonOption = False,
) -> None:
    """Put one message on a topic."""
    fields = document(body, "the body")
    with reached(ctx, system) as there:
        key = there.client.keys.topic(topic_name(name))
        uses = there.known.uses()
        use = uses.get(name)
        if use is None and not kind:
            hint = instead_of(name, uses)
            raise BadInput(f"{name!r} has no writer or reader, so its type is not known: give one with --type; {hint}")
        wanted = kind or (use.type if use else "")
        if use is not None and wanted != use.type:
            raise BadInput(f"{name} carries {use.type}, not {wanted}")
        ends = use.readers + use.writers if use else []
        found = message_types.described(there, wanted, *(component for component, _ in ends))
        payload = message_types.payload(found, fields)
        there.put(key, payload, found.encoding)
    if as_json:
        show_json({"topic": name, "type": wanted, "message": read_plain(payload, found.encoding)})
    else:
        say(f"put one {wanted} on {name}")
