"""The Architectural Adaptation Layer: changes a running system as transactions, and keeps their journal."""
