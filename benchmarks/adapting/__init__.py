"""The cost of changes, and the messages that they lose."""
