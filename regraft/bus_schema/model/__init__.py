"""The model of a system: architecture, lifecycle, descriptions, adaptations, and their checks."""
