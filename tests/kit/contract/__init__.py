"""What both buses promise."""
