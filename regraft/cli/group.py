"""Exit codes, and how what goes wrong becomes one, with a line of text and no traceback."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup

from bus_schema.errors import SchemaError
from regraft.bus import BusError
from regraft.capacity import TooMany
from regraft.certificates import CannotMake
from regraft.cli.options import JSON
from regraft.cli.output import complain, show_json
from regraft.client import ClientError, ControlRefused, NoAnswer, NoSuchComponent, NoSuchHost
from regraft.joining import CannotJoin, NothingThere
from regraft.modules import CannotImport
from regraft.parameters import ParameterError
from regraft.process import NoSuchClass
from regraft.rundir import AlreadyRunning, NoRoom, NotRunning
from regraft.runtime.calling import CallFailed
from regraft.security import NotSecure
from regraft.stack import StackError
from regraft.system_secret import BadSecret
from regraft.tokens import BadToken, BadTokens

WELL, FAILED, BAD_INPUT, NOT_REACHABLE, INTERRUPTED = 0, 1, 2, 3, 130

EXIT_CODES = """\
\b
Exit codes:
  0    success
  1    what was asked for failed: an adaptation was rejected or rolled back, a call failed
  2    a mistake in what was typed, a file with errors, a system that runs already, a port in use: nothing was done
  3    no such system, or it cannot be reached
  130  interrupted
"""


class BadInput(Exception):
    """What was typed cannot be done; the text says what is wrong and what would be right."""


class Unreachable(Exception):
    """A system, or the part of it that is needed, is not there."""


class Failed(Exception):
    """What was asked for did not happen."""


BY_CODE: tuple[tuple[int, tuple[type[Exception], ...]], ...] = (
    (BAD_INPUT, (BadInput, StackError, CannotImport, NoSuchClass, AlreadyRunning, NoRoom, TooMany, ParameterError)),
    (BAD_INPUT, (SchemaError, NoSuchComponent, NoSuchHost, CannotJoin, NotSecure, BadSecret, CannotMake)),
    (BAD_INPUT, (BadToken, BadTokens)),
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
    document: dict[str, Any] = {"error": str(error), "code": NAMES[code], "exit_code": code}
    if isinstance(error, CallFailed):
        refusal = error.code or error.answer
        document["code"] = refusal.value if refusal else "no_answer"
        document |= {"field": error.field} if error.field else {}
        document |= {"retry_after": error.retry_after} if error.retry_after is not None else {}
    elif isinstance(error, ControlRefused):
        document["code"] = error.code.value
    return document


class Commands(TyperGroup):
    """All commands: turns the kit's errors into a message and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was given."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise typer.Exit(INTERRUPTED) from None
        except Exception as error:
            code = exit_code(error)
            if code is None:
                raise
            if ctx.meta.get(JSON):
                show_json(as_document(error, code), compact=True, err=True)
            else:
                complain(str(error))
            raise typer.Exit(code) from None
