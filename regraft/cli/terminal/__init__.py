"""What all commands read and print: options, numbers, values, tables, standard streams."""
