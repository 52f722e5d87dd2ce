"""Studies of SUAVE."""
