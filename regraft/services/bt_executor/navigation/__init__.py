"""Executors and navigators of trees that navigate: they know where the robot is."""
