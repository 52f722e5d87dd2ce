"""Maps the ground while the robot drives, and publishes where in the map it is."""
