"""The command line, ``regraft``: one module per group of commands."""
