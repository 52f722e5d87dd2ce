"""Trees, scripts and subtrees are loaded or refused."""
