"""The explorer: where the map ends, and where to go next to see beyond."""
