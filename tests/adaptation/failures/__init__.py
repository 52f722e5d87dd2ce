"""What fails on the way, and how it is undone."""
