"""SUAVE's pipeline inspection: its files, its decisions, its stubs, and its reaction times."""
