"""Pictures of a world, by OpenGL or by rays."""
