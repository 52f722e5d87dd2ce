"""The language server: pygls speaks the protocol, this module answers. Texts are those of the editor.

Diagnostics are made on a thread of their own, of the newest version of each text: an editor that sends faster than
they are made is not held up.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

from lsprotocol import types
from pygls.lsp.server import LanguageServer
from pygls.uris import to_fs_path

from regraft.adaptation_manager.planners.metacontrol.skills.diagnostics import Diagnostic, Severity
from regraft.adaptation_manager.planners.metacontrol.skills.outline import Entry, outline_of
from regraft.adaptation_manager.planners.metacontrol.skills.server.completion import Kind, proposals
from regraft.adaptation_manager.planners.metacontrol.skills.server.hover import described, word_at
from regraft.adaptation_manager.planners.metacontrol.skills.server.known_names import names_in
from regraft.adaptation_manager.planners.metacontrol.skills.server.positions import Lines
from regraft.adaptation_manager.planners.metacontrol.skills.server.texts import MAX_CHARACTERS, Text, Texts

SOURCE = "regraft"
MAX_DIAGNOSTICS = 500
SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
}
ITEMS = {
    Kind.KEYWORD: types.CompletionItemKind.Keyword,
    Kind.SKILL: types.CompletionItemKind.Interface,
    Kind.QUALITY: types.CompletionItemKind.Property,
    Kind.CONTEXT: types.CompletionItemKind.EnumMember,
    Kind.COMPONENT: types.CompletionItemKind.Module,
    Kind.CONFIGURATION: types.CompletionItemKind.EnumMember,
    Kind.PARAMETER: types.CompletionItemKind.Field,
    Kind.TYPE: types.CompletionItemKind.Class,
    Kind.VALUE: types.CompletionItemKind.Value,
}
SYMBOLS = {
    "quality": types.SymbolKind.Property,
    "component": types.SymbolKind.Module,
    "configuration": types.SymbolKind.EnumMember,
    "skill": types.SymbolKind.Interface,
    "realization": types.SymbolKind.Class,
}


def serve() -> None:
    """Serve an editor on standard input and output until it ends."""
    made().start_io()


def made() -> LanguageServer:
    """Return a server with all that it answers."""
    server = LanguageServer(SOURCE, version(SOURCE), text_document_sync_kind=types.TextDocumentSyncKind.Full)
    texts = Texts()
    checker = Checker(lambda uri: _publish(server, texts, uri))
    checker.start()

    def take(document: types.TextDocumentIdentifier) -> None:
        given = server.workspace.get_text_document(document.uri)
        path = Path(to_fs_path(document.uri) or "text.skills")
        texts.set(document.uri, path, given.version or 0, given.source)
        checker.ask(document.uri)

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: types.DidOpenTextDocumentParams) -> None:
        take(types.TextDocumentIdentifier(params.text_document.uri))

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: types.DidChangeTextDocumentParams) -> None:
        take(types.TextDocumentIdentifier(params.text_document.uri))

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: types.DidCloseTextDocumentParams) -> None:
        texts.remove(params.text_document.uri)
        none = types.PublishDiagnosticsParams(params.text_document.uri, [])
        server.text_document_publish_diagnostics(none)

    @server.feature(types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=[":", "[", "."]))
    def complete(params: types.CompletionParams) -> types.CompletionList:
        uri = params.text_document.uri
        content = texts.content(uri)[:MAX_CHARACTERS]
        path = Path(to_fs_path(uri) or "text.skills")
        names = names_in(content, path, texts.known(uri))
        offset = Lines(content, server.workspace.position_codec).offset(params.position)
        found = [types.CompletionItem(each.text, kind=ITEMS[each.kind]) for each in proposals(content, offset, names)]
        return types.CompletionList(is_incomplete=False, items=found)

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hover(params: types.HoverParams) -> types.Hover | None:
        uri = params.text_document.uri
        text = texts.get(uri)
        if text is None:
            return None
        offset = Lines(text.text, server.workspace.position_codec).offset(params.position)
        shown = described(text.known, word_at(text.text, offset))
        return types.Hover(types.MarkupContent(types.MarkupKind.PlainText, shown)) if shown else None

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        text = texts.get(params.text_document.uri)
        if text is None:
            return []
        lines = Lines(text.text, server.workspace.position_codec)
        return [_symbol(each, lines) for each in _here(outline_of(text.known), str(text.path))]

    return server


class Checker(threading.Thread):
    """Checks texts one at a time; of several questions about one, it answers the last."""

    def __init__(self, check: Callable[[str], None]) -> None:
        super().__init__(name="checker", daemon=True)
        self._check = check
        self._asked: dict[str, None] = {}
        self._is_asked = threading.Condition()

    def ask(self, uri: str) -> None:
        """Have a text checked soon."""
        with self._is_asked:
            self._asked[uri] = None
            self._is_asked.notify()

    def run(self) -> None:
        """Check what is asked for, until the process ends."""
        while True:
            with self._is_asked:
                self._is_asked.wait_for(lambda: self._asked)
                uri = next(iter(self._asked))
                del self._asked[uri]
            try:
                self._check(uri)
            except Exception:  # one text that cannot be checked must not end the checks of all others
                logging.getLogger(__name__).exception("%s could not be checked", uri)


def _publish(server: LanguageServer, texts: Texts, uri: str) -> None:
    text = texts.get(uri)
    if text is None:
        return
    lines = Lines(text.text, server.workspace.position_codec)
    found = [_diagnostic(each, text, lines) for each in text.checked.diagnostics[:MAX_DIAGNOSTICS]]
    server.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri, found, text.version))


def _diagnostic(each: Diagnostic, text: Text, lines: Lines) -> types.Diagnostic:
    """Return a diagnostic; one of an imported file is shown on the first line, with its place."""
    is_here = each.place.file == str(text.path)
    return types.Diagnostic(
        lines.range(each.place) if is_here else lines.whole(),
        each.message if is_here else f"{each.place}: {each.message}",
        severity=SEVERITIES[each.severity],
        code=each.code.value,
        source=SOURCE,
    )


def _here(entries: Iterable[Entry], file: str) -> Iterator[Entry]:
    """Yield the entries of a file; those below an entry of another file take its place."""
    for each in entries:
        below = tuple(_here(each.below, file))
        if each.place.file == file:
            yield replace(each, below=below)
        else:
            yield from below


def _symbol(entry: Entry, lines: Lines) -> types.DocumentSymbol:
    at = lines.range(entry.place)
    below = [_symbol(each, lines) for each in entry.below]
    # An editor wants ranges that enclose those below. The place of an entry is that of its name.
    ranges = [at, *(each.range for each in below)]
    whole = types.Range(
        min((each.start for each in ranges), key=_order), max((each.end for each in ranges), key=_order)
    )
    return types.DocumentSymbol(entry.name, SYMBOLS[entry.kind], whole, at, entry.detail or None, children=below)


def _order(position: types.Position) -> tuple[int, int]:
    return position.line, position.character
