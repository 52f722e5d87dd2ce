"""Simulated time in lockstep: the member's side, and the coordinator in the source of time."""
