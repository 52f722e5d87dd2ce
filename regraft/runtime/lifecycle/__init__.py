"""The lifecycle of one component, and the control queries that act on it."""
