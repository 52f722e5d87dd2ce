"""Decision files and the planners that decide by them."""
