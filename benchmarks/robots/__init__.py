"""What whole robots cost: their speed, memory, devices, qualities and estimates."""
