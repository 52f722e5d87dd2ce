"""Simulated time in step: the member's side, and the coordinator that lives in the source of time (the world)."""
