"""Promises of the robot's components."""
