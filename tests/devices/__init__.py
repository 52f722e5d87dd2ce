"""Promises about the devices of simulated robots."""
