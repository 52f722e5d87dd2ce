"""Starts a system on this machine, or joins one."""
