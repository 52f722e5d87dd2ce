"""``regraft topic``, ``service``, ``param``, ``types``: what components say, offer and let one set."""
