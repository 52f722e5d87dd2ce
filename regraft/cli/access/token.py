"""``regraft token``: who may act through the gateway besides the user that runs it."""

from __future__ import annotations

import re
from datetime import datetime
from typing import Annotated, Any

import typer

from regraft import run_directory
from regraft.bus_schema.keys import system_name
from regraft.cli.outcomes import BadInput
from regraft.cli.running_system import find
from regraft.cli.terminal.options import JsonOption, chosen_system
from regraft.cli.terminal.output import say, show_json, show_table
from regraft.security.tokens import Role, Token, Tokens

token = typer.Typer(
    help="Make, list and revoke the tokens by which others act over REST.", no_args_is_help=True, rich_markup_mode=None
)

SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86_400}
MAX_NUMBER = 30
DURATION = re.compile(r"([0-9]+)([smhd])")

SystemOfTokens = Annotated[
    str | None,
    typer.Option("--system", metavar="NAME", help="The system; needed if it does not run, or several run."),
]


@token.command("create")
def create(
    ctx: typer.Context,
    role: Annotated[Role, typer.Option("--role", help="administer permits all, operate all but exchanging code.")],
    duration: Annotated[str, typer.Option("--for", metavar="DURATION", help="The validity: 30m, 8h, 7d.")],
    name: Annotated[str, typer.Option("--name", metavar="NAME", help="For the journal and for revoking it.")] = "",
    system: SystemOfTokens = None,
    as_json: JsonOption = False,
) -> None:
    """Make a token and print it, this once: only its hash is kept."""
    seconds = seconds_of(duration)
    of = _system(ctx, system)
    text, made = Tokens(run_directory.folder(of)).create(role, seconds, name)
    if as_json:
        show_json({"system": of, "token": text, **_plain(made)})
        return
    say(text)
    # Not on standard output, so that a script can take the token from there.
    typer.echo(f"token {made.name}: {made.role.value} {of} until {_date(made.expires)}", err=True)
    typer.echo("it is not shown again; send it as 'Authorization: Bearer TOKEN'", err=True)


@token.command("list")
def list_tokens(ctx: typer.Context, system: SystemOfTokens = None, as_json: JsonOption = False) -> None:
    """List tokens: name, role, and until when they are valid."""
    of = _system(ctx, system)
    found = Tokens(run_directory.folder(of)).all()
    if as_json:
        show_json({"system": of, "tokens": [_plain(kept) for kept in found]})
        return
    rows = [
        (kept.name, kept.role.value, _date(kept.created), _date(kept.expires), "expired" if kept.expired else "")
        for kept in found
    ]
    show_table(("name", "role", "created", "expires", ""), rows, empty="no tokens")


@token.command("revoke")
def revoke(
    ctx: typer.Context,
    name: Annotated[str, typer.Argument(metavar="NAME", help="The token's name.")],
    system: SystemOfTokens = None,
    as_json: JsonOption = False,
) -> None:
    """Revoke a token: a running gateway refuses it from the next request on."""
    of = _system(ctx, system)
    gone = Tokens(run_directory.folder(of)).revoke(name)
    if as_json:
        show_json({"system": of, "revoked": gone.name})
    else:
        say(f"token {gone.name} is revoked")


def seconds_of(text: str) -> float:
    """Return a duration such as ``8h`` in seconds; raises BadInput.

    >>> [seconds_of(text) for text in ("90s", "30m", "8h", "7d")]
    [90.0, 1800.0, 28800.0, 604800.0]
    """
    match = DURATION.fullmatch(text.strip())
    if match is None:
        raise BadInput(f"--for {text!r} is no duration: must be a whole number and s, m, h or d, such as 30m, 8h or 7d")
    if len(match[1]) > MAX_NUMBER:
        raise BadInput(f"--for {text[:40]}... is too large: a token is valid for at most 366 days")
    return float(int(match[1]) * SECONDS[match[2]])


def _system(ctx: typer.Context, system: str | None) -> str:
    """Return the system that is meant, which need not run if it is named; raises NotRunning, BadKey."""
    name = chosen_system(ctx, system)
    return find(ctx, None).system if name is None else system_name(name)


def _plain(kept: Token) -> dict[str, Any]:
    return {
        "name": kept.name,
        "role": kept.role.value,
        "created": _date(kept.created),
        "expires": _date(kept.expires),
        "expired": kept.expired,
    }


def _date(seconds: float) -> str:
    return datetime.fromtimestamp(seconds).astimezone().isoformat(timespec="seconds")
