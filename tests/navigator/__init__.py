"""What the navigator's algorithms promise."""
