"""Patrol: a robot goes round the corridors of a building, from place to place."""
