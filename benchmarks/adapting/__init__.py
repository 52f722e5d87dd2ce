"""What changes cost, and what they lose."""
