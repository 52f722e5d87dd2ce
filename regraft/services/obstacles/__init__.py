"""Objects that stand in the room, found on the map, and where to look at them from."""
