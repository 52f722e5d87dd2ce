"""The ports of adapt decorators, and the values that they take."""
