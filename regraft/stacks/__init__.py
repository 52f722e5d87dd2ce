"""Robot systems to run: one folder each."""
