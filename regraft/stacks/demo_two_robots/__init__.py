"""Two Waffles of different size patrol the halves of one room, each with a mission of its own."""
