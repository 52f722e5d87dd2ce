"""Components and hosts, as an adaptation asks them for something."""
