"""The message types that ship with Regraft, by subject."""
