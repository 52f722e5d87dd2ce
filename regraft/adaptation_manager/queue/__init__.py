"""Where requests wait: until the manager has started, and for their turn."""
