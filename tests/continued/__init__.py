"""Evidence takes hours: it continues where it stopped."""
