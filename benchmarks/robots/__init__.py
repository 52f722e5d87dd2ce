"""The cost of whole robots: speed, memory, devices, qualities and estimates."""
