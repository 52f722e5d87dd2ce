"""What is too slow for the quick tests: many seeds, load, endurance. Run by ``make evidence``."""
