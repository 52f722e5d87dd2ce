"""Examples that run: ``python -m behavior_tree.examples.thermostat``."""
