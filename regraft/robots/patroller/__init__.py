"""A round robot that patrols buildings."""
