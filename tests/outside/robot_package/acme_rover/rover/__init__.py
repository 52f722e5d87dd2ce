"""The folder of the rover."""
