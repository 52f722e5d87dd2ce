"""The parts of a stack that the command line gives."""
