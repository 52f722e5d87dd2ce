"""The checks of a model, a file for each subject."""
