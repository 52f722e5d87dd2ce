"""The robot's components, one module or folder each."""
