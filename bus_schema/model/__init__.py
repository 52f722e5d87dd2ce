"""What a system is and should be: architecture, lifecycle, descriptions, adaptations, and the checks of them."""
