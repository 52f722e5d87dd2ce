"""FROG's studies, for ``regraft evaluate``: a module with a ``STUDY`` each."""
