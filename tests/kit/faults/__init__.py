"""Components that report, refuse and end as nobody should: the kit goes on, and everybody gets an answer."""
