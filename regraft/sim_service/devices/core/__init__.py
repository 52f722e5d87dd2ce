"""What all devices share: their base, their kit, failures, and how they are fitted to a world."""
