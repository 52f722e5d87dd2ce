"""Promises of simulated time in step."""
