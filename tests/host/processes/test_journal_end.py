"""A host keeps how far the journal has come, and knows all of it when it is asked."""

from __future__ import annotations

from contextlib import closing

from regraft.bus.zenoh_bus import open_bus
from regraft.bus_schema.encoding import codec
from regraft.bus_schema.keys import Keys
from regraft.bus_schema.messages.protocol.host import HostView, JournalEnd
from tests.host.conftest import Start


def test_a_host_knows_the_end_of_the_journal_that_was_sent_right_before(start: Start) -> None:
    system = start("  ticker: {class: tests.host.parts:Ticker}\n")
    keys = Keys("tests")
    with closing(open_bus(system.info.hub)) as bus:
        for line in range(1, 51):
            bus.ask(keys.host("local", "journal"), codec.encode(JournalEnd(line, term=1)), 5.0, lambda _: None)
            (answer,) = bus.query(keys.host("local", "view"), b"", 5.0)
            assert codec.decode(answer.payload, HostView).journal.line == line
