"""Services and actions: the side that asks, and the side that serves."""
