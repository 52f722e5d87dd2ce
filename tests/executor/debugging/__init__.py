"""Missions that stop in the middle of a tick."""
