"""Exit codes, and how what goes wrong becomes one, with a line of text and no traceback."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException

from regraft.bus.interface import BusError
from regraft.bus_schema.errors import SchemaError
from regraft.cli.outcomes import (
    BAD_INPUT,
    FAILED,
    INTERRUPTED,
    NOT_REACHABLE,
    BadInput,
    Failed,
    Unreachable,
)
from regraft.cli.terminal.options import JSON
from regraft.cli.terminal.output import complain, show_json
from regraft.client import ClientError, ControlRefused, NoAnswer, NoSuchComponent, NoSuchHost
from regraft.component.errors import CallFailed
from regraft.component.parameters import ParameterError
from regraft.process.main import NoSuchClass
from regraft.process.modules import CannotImport
from regraft.run_directory import AlreadyRunning, NoHome, NoRoom, NotRunning
from regraft.security.access import NotSecure
from regraft.security.certificates import CannotMake
from regraft.security.system_secret import BadSecret
from regraft.security.tokens import BadToken, BadTokens
from regraft.stack import StackError
from regraft.system.capacity import TooMany
from regraft.system.first_host import CannotJoin, NothingThere
from regraft.system.launch import NoPort

BY_CODE: tuple[tuple[int, tuple[type[Exception], ...]], ...] = (
    (BAD_INPUT, (BadInput, StackError, CannotImport, NoSuchClass, AlreadyRunning, NoRoom, TooMany, ParameterError)),
    (BAD_INPUT, (SchemaError, NoSuchComponent, NoSuchHost, CannotJoin, NotSecure, BadSecret, CannotMake)),
    (BAD_INPUT, (BadToken, BadTokens, NoHome, NoPort)),
    (NOT_REACHABLE, (Unreachable, NotRunning, NothingThere, BusError, NoAnswer)),
    (FAILED, (Failed, ClientError, CallFailed)),
)


def exit_code(error: Exception) -> int | None:
    """Return the exit code that an error means, None for one that should not have happened."""
    if isinstance(error, CallFailed) and error.is_bad_request:
        return BAD_INPUT
    return next((code for code, kinds in BY_CODE if isinstance(error, kinds)), None)


NAMES = {FAILED: "failed", BAD_INPUT: "bad_input", NOT_REACHABLE: "not_reachable"}
"""The codes of errors that have none of their own, by exit code."""


def as_document(error: Exception, code: int) -> dict[str, Any]:
    """Return an error as ``--json`` shows it: its text for people, its code for programs."""
    text = error.format_message() if isinstance(error, TyperException) else str(error)
    document: dict[str, Any] = {"error": text, "code": NAMES[code], "exit_code": code}
    if isinstance(error, CallFailed):
        refusal = error.code or error.answer
        document["code"] = refusal.value if refusal else "no_answer"
        document |= {"field": error.field} if error.field else {}
        document |= {"retry_after": error.retry_after} if error.retry_after is not None else {}
    elif isinstance(error, ControlRefused):
        document["code"] = error.code.value
    return document


def want_json(words: Sequence[str]) -> bool:
    """Return whether the words of a command line ask for JSON; those behind ``--`` are no options."""
    return "--json" in (words[: words.index("--")] if "--" in words else words)


def show_error(error: Exception, code: int, *, as_json: bool) -> None:
    """Print an error, as an object or for people."""
    if as_json:
        show_json(as_document(error, code), compact=True, err=True)
    else:
        complain(str(error))


class Commands(TyperGroup):
    """All commands: turns the kit's errors into a message and an exit code."""

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Read the words before the command's name, and note whether JSON is wanted.

        A mistake in what is typed may be found before the option ``--json`` is.
        """
        as_json = want_json(args)
        try:
            ctx = super().make_context(info_name, args, parent, **extra)
        except TyperException as error:
            if not as_json:
                raise
            show_error(error, BAD_INPUT, as_json=True)
            raise typer.Exit(BAD_INPUT) from None
        ctx.meta[JSON] = as_json
        return ctx

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was given."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise typer.Exit(INTERRUPTED) from None
        except TyperException as error:
            if not ctx.meta.get(JSON):
                raise  # typer shows how the command is used, too
            show_error(error, BAD_INPUT, as_json=True)
            raise typer.Exit(BAD_INPUT) from None
        except Exception as error:
            code = exit_code(error)
            if code is None:
                raise
            show_error(error, code, as_json=bool(ctx.meta.get(JSON)))
            raise typer.Exit(code) from None
