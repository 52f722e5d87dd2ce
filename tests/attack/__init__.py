"""Attacks with fresh chances: kills, freezes, damages, hostile input, and a table of what held."""
