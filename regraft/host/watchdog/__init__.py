"""Finds the processes that hang, and those that use more than they may."""
