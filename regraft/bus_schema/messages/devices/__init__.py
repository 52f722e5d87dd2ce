"""Messages of robots' devices."""
