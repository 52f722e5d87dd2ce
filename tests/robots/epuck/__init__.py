"""An e-puck, and its follower of walls."""
