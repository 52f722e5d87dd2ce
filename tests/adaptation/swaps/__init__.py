"""A component's run is replaced by another one."""
