"""Brings the robot to its dock and charges it."""
