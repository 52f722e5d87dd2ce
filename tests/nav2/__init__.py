"""Promises of Nav2's servers, of its leaves, and of its trees on a robot."""
