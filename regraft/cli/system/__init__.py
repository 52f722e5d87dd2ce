"""``regraft up``, ``host``, ``run``, ``ps``, ``logs``, ``doctor``: systems as a whole."""
