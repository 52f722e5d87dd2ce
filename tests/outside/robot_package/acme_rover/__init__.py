"""A rover that turns by a compass."""
