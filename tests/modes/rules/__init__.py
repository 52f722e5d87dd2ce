"""Rules: in files, of robots, of ROS, and by measured values."""
