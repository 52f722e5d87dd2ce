"""The built-in control nodes."""
