"""Each kind of change, one test file a kind."""
