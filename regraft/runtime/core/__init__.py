"""Tasks, timers and time of one component."""
