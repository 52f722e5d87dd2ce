"""What the gateway shows."""
