"""Breakpoints in missions: ticks that stop in their middle."""
