"""A package of somebody else's, installed and used."""
