"""Messages that are missing in their sources' numbering."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from regraft.cli.terminal.output import complain
from regraft.client import TopicSample


@dataclass(slots=True)
class Gaps:
    """Counts the messages that are missing between those of each run of a source."""

    _last: dict[tuple[str, int], int] = field(default_factory=dict)

    def before(self, sample: TopicSample) -> int:
        """Return how many messages are missing between this one and the one before it."""
        source = (sample.source, sample.incarnation)
        missing = sample.sequence - self._last.get(source, sample.sequence - 1) - 1
        self._last[source] = sample.sequence
        return max(0, missing)


def with_gaps_told(samples: Iterable[TopicSample]) -> Iterator[TopicSample]:
    """Yield all; what is missing before one is printed first."""
    gaps = Gaps()
    for sample in samples:
        missing = gaps.before(sample)
        if missing:
            those = "1 message is" if missing == 1 else f"{missing} messages are"
            complain(f"{sample.source}: {those} missing before number {sample.sequence}")
        yield sample
