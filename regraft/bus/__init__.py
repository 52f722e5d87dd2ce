"""The bus: its interface, Zenoh, and a bus in memory for fast tests."""
