"""What the patrol keeps over many seeds."""
