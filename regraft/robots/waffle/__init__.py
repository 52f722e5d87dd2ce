"""A TurtleBot3 Waffle."""
