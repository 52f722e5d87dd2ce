"""Stack files are read: includes, overrides, references."""
