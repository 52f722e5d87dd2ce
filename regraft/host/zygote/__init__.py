"""The zygote, from which processes are forked, and what is asked of it."""
