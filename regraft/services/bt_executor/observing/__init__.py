"""Counts what nodes of a mission do, and records it."""
