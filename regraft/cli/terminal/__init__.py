"""Input and output of all commands: options, numbers, values, tables, standard streams."""
