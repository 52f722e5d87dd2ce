"""Two small components: one tells a number, the other remembers the last."""

from __future__ import annotations

from dataclasses import dataclass

from regraft import Component, Input, Output, Parameter, RequestRefused, action, every, service
from regraft.bus_schema.encoding.registry import message


@message("clitest/Number")
@dataclass(frozen=True, slots=True)
class Number:
    """A number."""

    value: float


@message("clitest/NumberRequest")
@dataclass(frozen=True, slots=True)
class NumberRequest:
    """Ask for the last number, times ``factor``."""

    factor: float = 1.0


class Talker(Component):
    """Tells a number, again and again."""

    number = Output(Number)
    step = Parameter(1.0, "added each time", minimum=0.0, maximum=10.0, unit="m")
    rate = Parameter(20.0, "how often", minimum=1.0, maximum=100.0, unit="Hz")

    def on_configure(self) -> None:
        """Begin at zero."""
        self._value = 0.0

    @every(hz=rate)
    def tell(self) -> None:
        """Tell the next number."""
        self._value += self.step
        self.number.publish(Number(self._value))


class Listener(Component):
    """Remembers the last number."""

    number = Input(Number)
    hint = Input(Number, topic="spare", required=False)
    offset = Parameter(0.0, "added to what is told", minimum=-100.0, maximum=100.0)

    def on_configure(self) -> None:
        """Begin without a number."""
        self._last: float | None = None

    @number.handler
    def hear(self, heard: Number) -> None:
        """Remember it."""
        self._last = heard.value

    @service("last_number")
    def last_number(self, request: NumberRequest) -> Number:
        """Return the last number."""
        if self._last is None:
            raise RequestRefused("nothing has been heard yet")
        return Number(self._last * request.factor + self.offset)

    @action("wait_for", feedback=Number)
    async def wait_for(self, goal: Number) -> Number:
        """Wait until a number at least as large was heard."""
        while self._last is None or self._last < goal.value:
            self.kit.feedback(Number(self._last or 0.0))
            await self.kit.sleep(0.05)
        return Number(self._last)
