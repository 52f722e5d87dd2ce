"""Drives a robot to goal poses: planning on a map, local control, recoveries."""
