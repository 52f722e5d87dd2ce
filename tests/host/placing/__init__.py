"""What hosts offer, and what is placed where."""
