"""YAML as nodes that know their lines, and the problems that are found in them."""
