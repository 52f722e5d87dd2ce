"""Runs one component: everything between the bus and the author's methods, on one thread."""
