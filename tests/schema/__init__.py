"""Promises of what travels on the bus."""
