"""Modes in full: targets and actual modes, rules, and the planner that enforces them."""
