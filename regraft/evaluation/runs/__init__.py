"""Single runs: their processes and their folders."""
