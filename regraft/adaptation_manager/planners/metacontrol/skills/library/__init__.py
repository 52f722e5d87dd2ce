"""Skills that other files import by the file's name."""
