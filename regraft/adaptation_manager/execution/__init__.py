"""One adaptation after the other: transaction, verification, confirmation, undo, recovery."""
