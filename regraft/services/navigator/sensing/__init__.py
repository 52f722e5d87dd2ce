"""The robot's perception, and whether it can be true."""
