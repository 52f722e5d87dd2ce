"""Changes that are refused before anything is touched."""
