"""From a path to a twist: local control, and what is done when the robot is stuck."""
