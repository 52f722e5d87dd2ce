"""Sensors and actuators of simulated robots, a file a kind."""
