"""Where a host writes its own log."""

from __future__ import annotations

import logging
from pathlib import Path

from regraft.cli.outcomes import BadInput
from regraft.process.logs import HOST_LOG


def log_to_file(run: Path) -> None:
    """Send the host's own log to the folder of its run, next to the others: what matters in it is shown as events.

    Raises:
        BadInput: the folder cannot be written.
    """
    folder = run / "logs"
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        logging.raiseExceptions = False  # a disk that is full is no matter for the terminal
        logging.basicConfig(
            filename=folder / HOST_LOG, format="%(asctime)s %(levelname)s %(name)s: %(message)s", force=True
        )
    except OSError as error:
        raise BadInput(f"cannot write to {folder}: {error.strerror}; REGRAFT_HOME names another place") from None
