"""Maps the ground while the robot drives, and tells where in the map it is."""
