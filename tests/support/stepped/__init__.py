"""Components stepped in one process."""
