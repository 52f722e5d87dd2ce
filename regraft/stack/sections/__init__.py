"""The sections of a stack file, each read by a file of its own."""
