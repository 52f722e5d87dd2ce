"""FROG: a robot that explores a room, drives from thing to thing and looks for a fire hydrant."""
