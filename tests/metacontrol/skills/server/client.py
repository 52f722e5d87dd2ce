"""An editor: a client that speaks JSON-RPC over standard input and output to the real server."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from pathlib import Path
from types import TracebackType
from typing import Any

from tests.support.waiting import PATIENCE

DEADLINE = 4 * PATIENCE


class Editor:
    """A server's process and the messages that came from it; every wait is bounded."""

    def __init__(self, encodings: tuple[str, ...] = ()) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", "from regraft.cli.entry import main; main()", "skills", "server"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        self._messages: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self._published: dict[str, dict[str, Any]] = {}
        self._number = 0
        threading.Thread(target=self._read, daemon=True).start()
        threading.Thread(target=self._drain, daemon=True).start()
        general = {"general": {"positionEncodings": list(encodings)}} if encodings else {}
        found = self.ask("initialize", {"processId": None, "rootUri": None, "capabilities": general})
        self.capabilities = found["capabilities"]
        self.tell("initialized", {})

    def __enter__(self) -> Editor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait(DEADLINE)
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            assert stream is not None
            stream.close()

    def ask(self, method: str, params: Any) -> Any:
        """Return the result of a request; raises AssertionError with its error."""
        self._number += 1
        self._send({"id": self._number, "method": method, "params": params})
        answer = self._wait(lambda message: message.get("id") == self._number and "method" not in message)
        assert "error" not in answer, answer
        return answer["result"]

    def tell(self, method: str, params: Any) -> None:
        """Send a notification."""
        self._send({"method": method, "params": params})

    def raw(self, data: bytes) -> None:
        """Send bytes that may be no message."""
        assert self._process.stdin is not None
        self._process.stdin.write(data)
        self._process.stdin.flush()

    def open(self, path: Path | str, text: str, version: int = 1) -> str:
        """Open a text, and return its URI."""
        uri = path.as_uri() if isinstance(path, Path) else path
        document = {"uri": uri, "languageId": "skills", "version": version, "text": text}
        self.tell("textDocument/didOpen", {"textDocument": document})
        return uri

    def change(self, uri: str, text: str, version: int) -> None:
        """Replace a text."""
        document = {"uri": uri, "version": version}
        self.tell("textDocument/didChange", {"textDocument": document, "contentChanges": [{"text": text}]})

    def diagnostics(self, uri: str, version: int = 1) -> list[dict[str, Any]]:
        """Return the diagnostics of a version of a text, when they have come."""

        def is_it(message: dict[str, Any]) -> bool:
            self._note(message)
            found = self._published.get(uri)
            return found is not None and found.get("version") == version

        known = self._published.get(uri)
        if known is None or known.get("version") != version:
            self._wait(is_it)
        return list(self._published[uri]["diagnostics"])

    def complete(self, uri: str, line: int, character: int) -> list[str]:
        """Return the words that are proposed at a position."""
        found = self.ask("textDocument/completion", self._at(uri, line, character))
        return [each["label"] for each in found["items"]]

    def hover(self, uri: str, line: int, character: int) -> str:
        """Return what is shown of the word at a position."""
        found = self.ask("textDocument/hover", self._at(uri, line, character))
        return "" if found is None else str(found["contents"]["value"])

    def symbols(self, uri: str) -> list[dict[str, Any]]:
        """Return the outline of a text."""
        return list(self.ask("textDocument/documentSymbol", {"textDocument": {"uri": uri}}))

    def close(self) -> int:
        """Shut the server down as the protocol has it, and return its exit code."""
        self.ask("shutdown", None)
        self.tell("exit", None)
        return self._process.wait(DEADLINE)

    @staticmethod
    def _at(uri: str, line: int, character: int) -> dict[str, Any]:
        return {"textDocument": {"uri": uri}, "position": {"line": line, "character": character}}

    def _send(self, message: dict[str, Any]) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self.raw(b"Content-Length: %d\r\n\r\n%s" % (len(body), body))

    def _note(self, message: dict[str, Any]) -> None:
        if message.get("method") == "textDocument/publishDiagnostics":
            self._published[message["params"]["uri"]] = message["params"]

    def _wait(self, wanted: Any) -> dict[str, Any]:
        while True:
            message = self._messages.get(timeout=DEADLINE)
            assert message is not None, "the server has ended"
            self._note(message)
            if wanted(message):
                return message

    def _read(self) -> None:
        stream = self._process.stdout
        assert stream is not None
        try:
            while header := stream.readline():
                length = 0
                while header.strip():
                    name, _, value = header.partition(b":")
                    length = int(value) if name.lower() == b"content-length" else length
                    header = stream.readline()
                self._messages.put(json.loads(stream.read(length)))
        except (OSError, ValueError):
            pass
        self._messages.put(None)

    def _drain(self) -> None:
        assert self._process.stderr is not None
        try:
            for _ in self._process.stderr:
                pass
        except ValueError:
            pass
