"""The Architectural Adaptation Layer: changes a running system as transactions, and keeps the journal of them."""
