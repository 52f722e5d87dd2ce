"""What the robot sees, and whether that can be true."""
