"""Weather for robots."""
