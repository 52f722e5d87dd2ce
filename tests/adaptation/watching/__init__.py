"""What is watched after an adaptation, and measured."""
