"""Estimates along connections: the qualities of a whole architecture, running or not, from its classes alone."""
