"""People in the world: how they walk and wait, and which groups come and go."""
