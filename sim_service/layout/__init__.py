"""What stands where in a world: its scene, what is drawn by the seed, its true map."""
