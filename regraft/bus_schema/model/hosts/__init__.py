"""Hosts, and their capability."""
