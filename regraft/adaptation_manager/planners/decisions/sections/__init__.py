"""The sections of a decision file, each read by a file of its own."""
