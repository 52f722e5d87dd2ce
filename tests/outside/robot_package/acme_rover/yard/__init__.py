"""The folder of a stack with two rovers."""
