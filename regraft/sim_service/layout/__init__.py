"""The layout of a world: its scene, the parts drawn by the seed, its true map."""
