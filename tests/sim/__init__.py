"""Promises of the simulated worlds."""
