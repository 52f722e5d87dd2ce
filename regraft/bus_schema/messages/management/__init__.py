"""Messages between a system, its manager and planners."""
