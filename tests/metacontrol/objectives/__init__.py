"""Objectives on the command line, over REST and in trees."""
