"""Promises of the adaptation manager, kept over the in-memory bus with real components in threads."""
