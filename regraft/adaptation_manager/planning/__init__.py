"""From a request to a plan: what is checked, which steps it takes, what it would take and give."""
