"""Claims of studies: written before the runs, judged after them by one rule."""
