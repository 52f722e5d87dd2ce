"""``regraft adapt``, ``swap``, ``mode``, ``planner``, ``journal``: what changes a running system."""
