"""Stacks that are run at full speed."""
