"""Places of a text as editors count them: from 0, in the units that editor and server have agreed on."""

from __future__ import annotations

from lsprotocol.types import Position, Range
from pygls.workspace import PositionCodec

from regraft.adaptation_manager.planners.metacontrol.skills.skill_model import Place


class Lines:
    """The lines of a text, which only line feeds end, as in the places of the language."""

    def __init__(self, text: str, codec: PositionCodec) -> None:
        self._lines = text.split("\n")
        self._codec = codec

    def range(self, place: Place) -> Range:
        """Return the range of a place."""
        start = self._position(place.line, place.column)
        end = self._position(place.end_line, place.end_column)
        return Range(start, end if (end.line, end.character) > (start.line, start.character) else start)

    def whole(self) -> Range:
        """Return the range of the first line."""
        return Range(Position(0, 0), Position(0, self._units(self._lines[0])))

    def offset(self, position: Position) -> int:
        """Return how many characters there are before a position; of a place that is not there, the nearest."""
        line = min(position.line, len(self._lines) - 1)
        before = sum(len(each) + 1 for each in self._lines[:line])
        return before + self._column(self._lines[line], position.character)

    def _column(self, line: str, units: int) -> int:
        if self._units(line) == len(line):
            return min(units, len(line))
        taken = 0
        for column, character in enumerate(line):
            if taken >= units:
                return column
            taken += self._units(character)
        return len(line)

    def _position(self, line: int, column: int) -> Position:
        number = min(max(line, 1), len(self._lines)) - 1
        return Position(number, self._units(self._lines[number][: max(column - 1, 0)]))

    def _units(self, text: str) -> int:
        return len(text) if text.isascii() else self._codec.client_num_units(text)
