"""Tables of results: one row a run, which anybody can make again."""
