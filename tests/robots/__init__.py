"""Robots other than FROG's, each a folder with data alone: no code of Regraft knows them."""
